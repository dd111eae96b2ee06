//! Sentences of the answer and of the warnings of the report with their Vietnamese texts.

/// Sentences like the messages on pairs. `{=0}` is a name, and `{!0}` a message of the program.
pub(super) const REPORT_ANSWERS: &[(&str, &str)] = &[
    (
        "There is nothing to report: all {} pairs of the project are retired.",
        "Không có gì để báo cáo: cả {0} cặp của dự án đã được đưa ra khỏi thống kê.",
    ),
    (
        "There is nothing to report: the only pair of the project is retired.",
        "Không có gì để báo cáo: cặp duy nhất của dự án đã được đưa ra khỏi thống kê.",
    ),
    (
        "In the app, the page Pairs has the reason.",
        "Trong ứng dụng, trang Các cặp cho biết lý do.",
    ),
    (
        "The project has no pairs yet: {}.",
        "Dự án chưa có cặp nào: {0}.",
    ),
    ("The project has no pairs yet.", "Dự án chưa có cặp nào."),
    (
        "In the app, the page Import adds them.",
        "Trong ứng dụng, hãy thêm các cặp ở trang Nhập dữ liệu.",
    ),
    ("Characters are missing: {}.", "Còn thiếu các chữ: {0}."),
    (
        "{}; {} failed and {} is not finished.",
        "{0}; {1} bị lỗi và {2} chưa xong.",
    ),
    (
        "{}; {} failed and {} are not finished.",
        "{0}; {1} bị lỗi và {2} chưa xong.",
    ),
    ("{}; {} failed.", "{0}; {1} bị lỗi."),
    ("{}; {} is not finished.", "{0}; {1} chưa xong."),
    ("{}; {} are not finished.", "{0}; {1} chưa xong."),
    (
        "{}, none with a confidence below {}.",
        "{0}, không cặp nào có độ tin cậy dưới {1}.",
    ),
    (
        "The only pair is aligned, with a confidence below {}.",
        "Cặp duy nhất đã được căn chỉnh, với độ tin cậy dưới {0}.",
    ),
    (
        "{} of {} pairs are aligned, {} with a confidence below {}.",
        "{0} trên {1} cặp đã được căn chỉnh, {2} cặp có độ tin cậy dưới {3}.",
    ),
    (
        "{} of {} pairs is aligned, {} with a confidence below {}.",
        "{0} trên {1} cặp đã được căn chỉnh, {2} cặp có độ tin cậy dưới {3}.",
    ),
    (
        "{} of {} pairs is aligned, with a confidence below {}.",
        "{0} trên {1} cặp đã được căn chỉnh, với độ tin cậy dưới {2}.",
    ),
    (
        "All {} pairs are aligned, {} with a confidence below {}.",
        "Cả {0} cặp đã được căn chỉnh, {1} cặp có độ tin cậy dưới {2}.",
    ),
    (
        "Both pairs are aligned, {} with a confidence below {}.",
        "Cả hai cặp đã được căn chỉnh, {0} cặp có độ tin cậy dưới {1}.",
    ),
    (
        "The only pair is aligned.",
        "Cặp duy nhất đã được căn chỉnh.",
    ),
    (
        "The only pair is not aligned.",
        "Cặp duy nhất chưa được căn chỉnh.",
    ),
    (
        "None of the {} pairs is aligned.",
        "Chưa cặp nào trong {0} cặp được căn chỉnh.",
    ),
    ("Both pairs are aligned.", "Cả hai cặp đã được căn chỉnh."),
    ("All {} pairs are aligned.", "Cả {0} cặp đã được căn chỉnh."),
    (
        "{} of {} pairs is aligned.",
        "{0} trên {1} cặp đã được căn chỉnh.",
    ),
    (
        "{} of {} pairs are aligned.",
        "{0} trên {1} cặp đã được căn chỉnh.",
    ),
    (
        "There is no result to judge yet.",
        "Chưa có kết quả nào để đánh giá.",
    ),
    (
        "In the app, the page Run continues the work.",
        "Trong ứng dụng, trang Căn chỉnh làm tiếp việc này.",
    ),
    (
        "Failed pairs are listed below with their reasons.",
        "Các cặp lỗi được liệt kê bên dưới cùng với lý do.",
    ),
    (
        "Acc of {} is {} ({}, {} interval): reviewers passed {} of {}.",
        "Acc của {0} là {1} ({2}, khoảng {3}): người đánh giá cho đạt {4} trên {5}.",
    ),
    (
        "Not counted: {} on which reviewers disagree and {} about which they were unsure.",
        "Không tính: {0} kết quả có bất đồng và {1} kết quả chưa chắc.",
    ),
    (
        "Not counted: {} on which reviewers disagree.",
        "Không tính: {0} kết quả có bất đồng.",
    ),
    (
        "Not counted: {} about which they were unsure.",
        "Không tính: {0} kết quả chưa chắc.",
    ),
    (
        "{} noticed only {} of {} attention checks, so this Acc may be wrong.",
        "{=0} chỉ phát hiện {1} trên {2} lỗi cài sẵn, nên Acc này có thể sai.",
    ),
    (
        "{} reviewers missed most of their attention checks, so this Acc may be wrong.",
        "{0} người đánh giá bỏ sót phần lớn các lỗi cài sẵn, nên Acc này có thể sai.",
    ),
    (
        "There is no Acc, because reviewers were unsure about every judged result, or disagree about it.",
        "Chưa có Acc, vì mọi kết quả đã đánh giá đều được ghi là chưa chắc hoặc có bất đồng.",
    ),
    (
        "There is no Acc, because reviewers were unsure about every judged result.",
        "Chưa có Acc, vì mọi kết quả đã đánh giá đều được ghi là chưa chắc.",
    ),
    (
        "There is no Acc, because reviewers disagree about every judged result.",
        "Chưa có Acc, vì người đánh giá bất đồng về mọi kết quả đã đánh giá.",
    ),
    (
        "There is no Acc, because every verdict is on an earlier result.",
        "Chưa có Acc, vì mọi đánh giá đều cho kết quả của lần tính trước.",
    ),
    (
        "Nobody has judged a result yet, so there is no Acc.",
        "Chưa ai đánh giá kết quả nào, nên chưa có Acc.",
    ),
    (
        "In the app, results are judged on the page Review.",
        "Trong ứng dụng, các kết quả được đánh giá ở trang Đánh giá.",
    ),
    (
        "Against ground truth, {} of {} results of {} are right, {}.",
        "Theo dữ liệu đối chứng, {0} trên {1} kết quả của {2} là đúng, {3}.",
    ),
    (
        "Against ground truth, {} of {} results of {} is right, {}.",
        "Theo dữ liệu đối chứng, {0} trên {1} kết quả của {2} là đúng, {3}.",
    ),
    (
        "By {}, no two metrics differ on a pair: both are right, or both are wrong.",
        "Theo {0}, không có hai độ đo nào khác nhau ở một cặp: cả hai đúng hoặc cả hai sai.",
    ),
    (
        "No difference between metrics is significant by {} (smallest {} after Holm's correction).",
        "Theo {0}, không có khác biệt có ý nghĩa giữa các độ đo (nhỏ nhất là {1} sau hiệu chỉnh Holm).",
    ),
    (
        "To show one between {} and {}, {} would be needed.",
        "Để thấy khác biệt giữa {0} và {1}, cần {2}.",
    ),
    (
        "This assumes 80 % power and a 5 % level.",
        "Giả định lực kiểm định 80 % và mức ý nghĩa 5 %.",
    ),
    (
        "More pairs would be needed to show one after the correction.",
        "Cần nhiều cặp hơn để thấy khác biệt sau hiệu chỉnh.",
    ),
    (
        "How many pairs would show one cannot be estimated from fewer than 20.",
        "Với chưa đến 20 cặp, không ước lượng được cần bao nhiêu cặp.",
    ),
    (
        "Each metric alone is right on as many pairs as the others.",
        "Số cặp mà chỉ một độ đo đúng là như nhau ở các độ đo.",
    ),
    (
        "By {}, {} is right significantly more often than {}.",
        "Theo {0}, {1} đúng nhiều hơn {2} một cách có ý nghĩa.",
    ),
    (
        "By {}, {} are right significantly more often than {}.",
        "Theo {0}, {1} đúng nhiều hơn {2} một cách có ý nghĩa.",
    ),
    (
        "No other tested difference is significant (McNemar's exact test, Holm's correction).",
        "Không có khác biệt nào khác có ý nghĩa (kiểm định McNemar chính xác, hiệu chỉnh Holm).",
    ),
    (
        "Every tested difference is significant (McNemar's exact test, Holm's correction).",
        "Mọi khác biệt đã kiểm định đều có ý nghĩa (kiểm định McNemar chính xác, hiệu chỉnh Holm).",
    ),
    (
        "{} is right significantly more often than {}.",
        "{0} đúng nhiều hơn {1} một cách có ý nghĩa.",
    ),
    (
        "{} are right significantly more often than {}.",
        "{0} đúng nhiều hơn {1} một cách có ý nghĩa.",
    ),
    (
        "{} is right significantly more often.",
        "{0} đúng nhiều hơn một cách có ý nghĩa.",
    ),
    (
        "{} is right more often, but not significantly after correction for several comparisons.",
        "{0} đúng nhiều hơn, nhưng không có ý nghĩa sau hiệu chỉnh cho nhiều phép so sánh.",
    ),
    (
        "No difference: on each pair both are right, or both are wrong.",
        "Không khác biệt: ở mỗi cặp, cả hai đúng hoặc cả hai sai.",
    ),
    (
        "No significant difference: each alone is right on as many pairs as the other.",
        "Không có khác biệt có ý nghĩa: số cặp mà chỉ một bên đúng là như nhau.",
    ),
    (
        "No significant difference.",
        "Không có khác biệt có ý nghĩa.",
    ),
    (
        "Metrics are not compared, because fewer than {} pairs are judged for two of them.",
        "Không so sánh các độ đo, vì chưa đến {0} cặp được đánh giá cho hai độ đo.",
    ),
    (
        "Reviewers passed or failed the results of no two metrics, so no metric is known to be right more often than another.",
        "Chưa có hai độ đo nào có kết quả được cho đạt hoặc không đạt, nên chưa biết độ đo nào đúng nhiều hơn.",
    ),
    (
        "Reviewers judged the results of one metric only, so no metric is known to be right more often than another.",
        "Mới đánh giá kết quả của một độ đo, nên chưa biết độ đo nào đúng nhiều hơn.",
    ),
    (
        "Without verdicts, no metric is known to be right more often than another.",
        "Chưa có đánh giá nên chưa biết độ đo nào đúng nhiều hơn.",
    ),
    (
        "By score, {} of {} differences between metrics are significant (paired bootstrap, Holm's correction).",
        "Theo điểm số, {0} trên {1} khác biệt giữa các độ đo có ý nghĩa (bootstrap theo cặp, hiệu chỉnh Holm).",
    ),
    (
        "{} of {} are in no row: {}.",
        "{0} trên {1} không có trong bảng nào: {2}.",
    ),
    (
        "{} of {} is in no row: {}.",
        "{0} trên {1} không có trong bảng nào: {2}.",
    ),
    (
        "{} noticed {} of {} attention checks.",
        "{=0} phát hiện {1} trên {2} lỗi cài sẵn.",
    ),
    (
        "Let another person judge the same results.",
        "Hãy để người khác đánh giá cùng các kết quả đó.",
    ),
    (
        "Or let this one practise (key ? on the review page) and judge again.",
        "Hoặc hãy để người này luyện tập (phím ? ở trang đánh giá) rồi đánh giá lại.",
    ),
    (
        "Means have no intervals, and metrics are not compared by score.",
        "Trung bình không có khoảng tin cậy, và các độ đo không được so sánh theo điểm số.",
    ),
    (
        "There are more than {}, and sampling error is negligible.",
        "Có hơn {0} nên sai số lấy mẫu không đáng kể.",
    ),
    (
        "An interval needs at least {}, and there is {}.",
        "Một khoảng tin cậy cần ít nhất {0}, hiện có {1}.",
    ),
    (
        "An interval needs at least {}, and there are {}.",
        "Một khoảng tin cậy cần ít nhất {0}, hiện có {1}.",
    ),
    (
        "{}: a mean Dice of {} is above {}, the most that a mean IoU of {} allows.",
        "{0}: Dice trung bình {1} vượt quá {2}, mức cao nhất mà IoU trung bình {3} cho phép.",
    ),
    (
        "The two cannot be of the same masks.",
        "Hai số này không thể của cùng các mặt nạ.",
    ),
    (
        "{}: of {}, {} has a verdict on an earlier result only.",
        "{0}: trong {1}, {2} kết quả chỉ có đánh giá cho lần tính trước.",
    ),
    (
        "{}: of {}, {} have a verdict on an earlier result only.",
        "{0}: trong {1}, {2} kết quả chỉ có đánh giá cho lần tính trước.",
    ),
    (
        "{}: of {}, {} is unsure because reviewers disagree.",
        "{0}: trong {1}, {2} kết quả chưa chắc vì người đánh giá bất đồng.",
    ),
    (
        "{}: of {}, {} are unsure because reviewers disagree.",
        "{0}: trong {1}, {2} kết quả chưa chắc vì người đánh giá bất đồng.",
    ),
    (
        "{}: of {}, {} is mirrored (angle error 180 degrees).",
        "{0}: trong {1}, {2} kết quả bị lật gương (sai góc 180 độ).",
    ),
    (
        "{}: of {}, {} are mirrored (angle error 180 degrees).",
        "{0}: trong {1}, {2} kết quả bị lật gương (sai góc 180 độ).",
    ),
    (
        "{} cannot be used and count nowhere.",
        "{0} không dùng được và không được tính.",
    ),
    ("The first: {}.", "Đầu tiên: {!0}."),
    (
        "1 stored row that is damaged is set apart and not counted, first: {}.",
        "1 dòng dữ liệu bị hỏng được để riêng và không tính, đầu tiên: {!0}.",
    ),
    (
        "{} stored rows that are damaged or missing are set apart and not counted, first: {}.",
        "{0} dòng dữ liệu bị hỏng hoặc mất được để riêng và không tính, đầu tiên: {!1}.",
    ),
    (
        "In the app, the page Health lists them.",
        "Trong ứng dụng, trang Tình trạng liệt kê chúng.",
    ),
];
