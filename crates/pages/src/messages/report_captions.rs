//! Captions of tables and plots of the HTML report, and lines on its origin, with their Vietnamese texts.

/// Sentences like those of the answer. A pattern that begins with a part comes after the sentences that it would fit.
pub(super) const REPORT_CAPTIONS: &[(&str, &str)] = &[
    (
        "Acc is the share of passed results among the decided ones, which reviewers passed or failed.",
        "Acc là tỉ lệ kết quả đạt trong số kết quả được đánh giá đạt hoặc không đạt.",
    ),
    (
        "SSIM, IoU and Dice are means over n pairs, computed by pixel.",
        "SSIM, IoU và Dice là trung bình trên n cặp, tính theo điểm ảnh.",
    ),
    (
        "IoU box is that of the bounding boxes.",
        "IoU khung là IoU của các khung bao.",
    ),
    ("Results by verdict.", "Số kết quả theo đánh giá."),
    (
        "Stale: only an earlier result has a verdict.",
        "Cũ: chỉ kết quả của lần tính trước có đánh giá.",
    ),
    (
        "Acc under three rules for results on which reviewers disagree.",
        "Acc theo ba quy tắc cho kết quả mà người đánh giá bất đồng.",
    ),
    (
        "Either: a result fails if one reviewer fails it.",
        "Một người: kết quả không đạt nếu có một người cho không đạt.",
    ),
    (
        "Adjudicated: it counts as in the Acc above.",
        "Phân xử: tính như Acc ở trên.",
    ),
    (
        "Both: it fails only if both fail it.",
        "Cả hai: chỉ không đạt nếu cả hai cho không đạt.",
    ),
    (
        "n is the number of decided results.",
        "n là số kết quả đạt hoặc không đạt.",
    ),
    (
        "Double is the number that at least two reviewers decided.",
        "Hai lượt là số kết quả được ít nhất hai người cho đạt hoặc không đạt.",
    ),
    (
        "Failed results by the reasons that reviewers gave; a result may have several.",
        "Số kết quả không đạt theo lý do của người đánh giá; một kết quả có thể có nhiều lý do.",
    ),
    (
        "Faults planted in good results that reviewers failed, of those that they answered.",
        "Số lỗi cài vào kết quả tốt mà người đánh giá cho không đạt, trong số lỗi họ đã trả lời.",
    ),
    (
        "This shows how well they find such faults, and no others.",
        "Số này chỉ cho biết họ phát hiện các lỗi như vậy đến đâu.",
    ),
    (
        "Errors against ground truth.",
        "Sai số so với dữ liệu đối chứng.",
    ),
    (
        "Acc here counts results within three limits.",
        "Ở đây Acc đếm kết quả trong ba giới hạn.",
    ),
    (
        "The angle is within 5 degrees, and landmarks are within 5 % of the character's height.",
        "Góc lệch không quá 5 độ, các điểm mốc lệch không quá 5 % chiều cao chữ.",
    ),
    (
        "The mask IoU with the true stroke tops is at least 0.7.",
        "IoU của mặt nạ với mặt nét đúng ít nhất là 0,7.",
    ),
    (
        "Angle, landmarks and mask IoU are medians.",
        "Góc, điểm mốc và IoU mặt nạ là trung vị.",
    ),
    (
        "Whole blocks against ground truth.",
        "Cả ván so với dữ liệu đối chứng.",
    ),
    (
        "True: characters that the page shows whole.",
        "Đúng: số chữ hiện trọn trên trang in.",
    ),
    (
        "Found: those that were cut and aligned.",
        "Tìm được: số chữ đã được cắt và căn chỉnh.",
    ),
    (
        "Right as above, and tight if landmarks are within 1.5 %, both for {}.",
        "Chuẩn: như trên; sát: điểm mốc lệch không quá 1,5 %; cả hai theo {0}.",
    ),
    (
        "P and R: precision and recall of boxes that were found without labels.",
        "P và R: độ chính xác và độ phủ của các khung tự tìm khi không có nhãn.",
    ),
    (
        "50 and 70: at an IoU of at least 0.5 and 0.7.",
        "50 và 70: với IoU ít nhất 0,5 và 0,7.",
    ),
    (
        "Errors against manual alignments, over the n pairs that have one.",
        "Sai số so với căn chỉnh thủ công, trên n cặp có căn chỉnh thủ công.",
    ),
    (
        "The first column is the share within 5 degrees.",
        "Cột đầu là tỉ lệ lệch không quá 5 độ.",
    ),
    (
        "Angle, shift and difference in scale are medians and 95th percentiles.",
        "Góc, độ dời và chênh lệch tỉ lệ là trung vị và bách phân vị 95.",
    ),
    (
        "Shift is in percent of the relief's longer side.",
        "Độ dời tính theo phần trăm cạnh dài của mặt khắc.",
    ),
    (
        "Relative height of the thresholds: 5th percentile, median and 95th percentile.",
        "Độ cao tương đối của ngưỡng: bách phân vị 5, trung vị và bách phân vị 95.",
    ),
    (
        "0 is the lowest point of a depth map, and 1 its highest.",
        "0 là điểm thấp nhất của bản đồ độ sâu, 1 là điểm cao nhất.",
    ),
    (
        "Computing time of the current results by stage, on one core.",
        "Thời gian tính các kết quả hiện tại theo giai đoạn, trên một nhân.",
    ),
    (
        "Median and 95th percentile are in milliseconds, the sum in seconds.",
        "Trung vị và bách phân vị 95 tính bằng mili giây, tổng tính bằng giây.",
    ),
    (
        "Pairs on which only the first or only the second metric is right, by {}, of n.",
        "Số cặp mà chỉ độ đo thứ nhất hoặc chỉ độ đo thứ hai đúng theo {0}, trong n cặp.",
    ),
    (
        "Test: McNemar, exact, two-sided, with Holm's correction.",
        "Kiểm định: McNemar chính xác, hai phía, có hiệu chỉnh Holm.",
    ),
    ("Compared by {}: {}.", "So sánh theo {0}: {1}."),
    (
        "95 % intervals of the means above, by the percentile bootstrap ({}, {} resamples, seed {}).",
        "Khoảng 95 % của các trung bình ở trên, theo bootstrap bách phân vị ({0}, {1} lần lấy mẫu lại, số hạt giống {2}).",
    ),
    (
        "Mean of the first minus mean of the second on the same pairs.",
        "Trung bình của độ đo thứ nhất trừ trung bình của độ đo thứ hai trên cùng các cặp.",
    ),
    (
        "Intervals and two-sided p are by the percentile bootstrap ({}, {} resamples, seed {}).",
        "Khoảng tin cậy và p hai phía theo bootstrap bách phân vị ({0}, {1} lần lấy mẫu lại, số hạt giống {2}).",
    ),
    (
        "Holm's correction is within each score.",
        "Hiệu chỉnh Holm trong từng loại điểm.",
    ),
    (
        "A higher score does not mean a better alignment: a mask that copies the ink would score best.",
        "Điểm cao hơn không có nghĩa là căn chỉnh tốt hơn: mặt nạ chép lại mực sẽ có điểm cao nhất.",
    ),
    (
        "{}: {} is significantly higher ({}).",
        "{0}: {1} cao hơn một cách có ý nghĩa ({2}).",
    ),
    (
        "{}: {} is higher, but not significantly after correction for several comparisons ({}).",
        "{0}: {1} cao hơn, nhưng không có ý nghĩa sau hiệu chỉnh cho nhiều phép so sánh ({2}).",
    ),
    (
        "{}: equal on all pairs ({}).",
        "{0}: bằng nhau ở mọi cặp ({1}).",
    ),
    (
        "{}: no significant difference ({}).",
        "{0}: không có khác biệt có ý nghĩa ({1}).",
    ),
    (
        "{}: too few {} for a test ({}).",
        "{0}: quá ít {1} để kiểm định ({2}).",
    ),
    (
        "{} is significantly higher ({}).",
        "{0} cao hơn một cách có ý nghĩa ({1}).",
    ),
    (
        "{} is higher, but not significantly after correction for several comparisons ({}).",
        "{0} cao hơn, nhưng không có ý nghĩa sau hiệu chỉnh cho nhiều phép so sánh ({1}).",
    ),
    ("Equal on all pairs ({}).", "Bằng nhau ở mọi cặp ({0})."),
    (
        "No significant difference ({}).",
        "Không có khác biệt có ý nghĩa ({0}).",
    ),
    (
        "Too few {} for a test ({}).",
        "Quá ít {0} để kiểm định ({1}).",
    ),
    (
        "Acc in percent by {} of the most confident results.",
        "Acc (%) theo {0} của các kết quả đáng tin nhất.",
    ),
    (
        "Coverage is the share of results that is kept.",
        "Độ phủ là tỉ lệ kết quả được giữ lại.",
    ),
    (
        "{}: the least confident {} of {} ({} %) hold {} of {}.",
        "{0}: {1} kết quả kém tin cậy nhất trong {2} ({3} %) chứa {4} trên {5}.",
    ),
    (
        "Acc by {} of the most confident results, by the share of results that is kept.",
        "Acc theo {0} của các kết quả đáng tin nhất, theo tỉ lệ kết quả được giữ lại.",
    ),
    (
        "Lines that lie on each other: {}.",
        "Các đường trùng nhau: {0}.",
    ),
    (
        "{} of all results and {} of half of them.",
        "{0} của mọi kết quả và {1} của một nửa số đó.",
    ),
    (
        "Results kept, the most confident first (%)",
        "Kết quả được giữ, đáng tin nhất trước (%)",
    ),
    ("Acc by {} (%)", "Acc theo {0} (%)"),
    (
        "Acc by {} of each metric (point), with its {} interval (line).",
        "Acc theo {0} của từng độ đo (điểm), với khoảng {1} (đoạn thẳng).",
    ),
    (
        "Computing time of a pair by stage: the median (point), with a line to the 95th percentile.",
        "Thời gian tính một cặp theo giai đoạn: trung vị (điểm), với đoạn thẳng đến bách phân vị 95.",
    ),
    (
        "Computing time per pair (ms)",
        "Thời gian tính mỗi cặp (ms)",
    ),
    (
        "Results of each metric by the relative height of their threshold.",
        "Kết quả của từng độ đo theo độ cao tương đối của ngưỡng.",
    ),
    (
        "A dashed line and the number beside it show the median.",
        "Đường đứt nét và con số bên cạnh cho biết trung vị.",
    ),
    ("{} median {}.", "{0}: trung vị {1}."),
    (
        "Relative height (0 lowest, 1 highest point of the depth map)",
        "Độ cao tương đối (0 là điểm thấp nhất, 1 là điểm cao nhất của bản đồ độ sâu)",
    ),
    (
        "Hashes are the first 12 digits.",
        "Mã băm gồm 12 chữ số đầu.",
    ),
    (
        "The report as JSON has them whole, and all digits of every number.",
        "Báo cáo dạng JSON có toàn bộ mã băm và mọi chữ số của từng số.",
    ),
    ("{}, meshes and prints {}", "{0}, bản quét và bản in {=1}"),
    ("{} by {} reviewers", "{0} của {1} người đánh giá"),
    ("{} by {} reviewer", "{0} của {1} người đánh giá"),
    ("{} (bootstrap)", "{0} (bootstrap)"),
    ("{}, {}, all default", "{=0}, {1}, tất cả theo mặc định"),
    ("{}, all default", "{=0}, tất cả theo mặc định"),
    ("IoU {}, confidence {}", "IoU {0}, độ tin cậy {1}"),
];
