//! What each setting means, in the language of a page. The English texts are the comments of the settings file.

use super::number_text::grouped;
use super::visit::Visit;
use crate::review::Language;
use mocban_config::{Origin, explanation};
use mocban_core::domain::one_line;

/// Sections that the page leaves out: addresses of databases and stores, and keys.
const HIDDEN: [&str; 2] = ["storage", "review"];

/// Returns whether the page leaves out a setting.
pub(super) fn is_hidden(key: &str) -> bool {
    let first = key.split('.').next().unwrap_or_default();
    HIDDEN.contains(&first)
}

/// The settings of the page with their meaning, unit, range and reason in Vietnamese. Values to type keep the point; other
/// numbers have a comma.
const VIETNAMESE: [(&str, &str); 35] = [
    (
        "limits.mesh.max_bytes",
        "Dung lượng lớn nhất của tệp bản quét, tính bằng byte; 2 GiB chứa được mọi bản quét của một chữ. 1 đến 1e15.",
    ),
    (
        "limits.mesh.max_vertices",
        "Số đỉnh nhiều nhất; 50 triệu đỉnh chiếm 0,6 GB ở độ chính xác đơn, 1,2 GB ở độ chính xác kép. 3 đến 4294967295.",
    ),
    (
        "limits.mesh.max_triangles",
        "Số tam giác nhiều nhất sau khi các đa giác được chia nhỏ; 100 triệu chiếm 1,2 GB. 1 đến 4294967295.",
    ),
    (
        "limits.image.max_bytes",
        "Dung lượng lớn nhất của tệp hình, tính bằng byte; 256 MiB là rộng rãi cho một chữ. 1 đến 1e15.",
    ),
    (
        "limits.image.max_pixels",
        "Tích lớn nhất của chiều rộng và chiều cao, tính bằng điểm ảnh; mỗi điểm ảnh cần khoảng 50 byte khi tính, nên 30 triệu cần 1,5 GB. 1 đến 1e9.",
    ),
    (
        "run.workers",
        "Số cặp được tính cùng lúc, mỗi cặp trên một lõi; 0 là mỗi lõi một cặp. 0 đến 1024.",
    ),
    (
        "run.memory_mib",
        "Bộ nhớ (MiB) mà các cặp được tính cùng lúc có thể cần, ước lượng theo dung lượng tệp; cặp cần nhiều hơn sẽ chạy một mình. 0 là 80 % bộ nhớ trống khi bắt đầu. 0 đến 1e9.",
    ),
    (
        "run.stage_timeout_s",
        "Thời gian dài nhất (giây) cho một giai đoạn của một cặp hoặc ván; sau đó cặp được thử thêm một lần, khi không có gì khác đang chạy. 1 đến 86400.",
    ),
    (
        "pipeline.method",
        "Phương pháp căn chỉnh: \"default\" là phương pháp tốt nhất được biết (tìm tư thế trước, tìm ngưỡng sau khi đã căn chỉnh), \"paper\" là phương pháp của bài báo (arXiv 2411.05524). Các thiết lập bên dưới chỉ dùng cho \"paper\" bắt đầu bằng \"Phương pháp của bài báo\".",
    ),
    (
        "fit.curved_blocks",
        "Có cho phép khớp mặt bậc hai ở chỗ ván bị cong không; ván cong khoảng 2,6 mm trên 330 mm. true hoặc false.",
    ),
    (
        "fit.min_relief",
        "Độ nổi nhỏ nhất của mặt khắc so với kích thước bản quét; dưới mức này coi như không có gì được khắc. Ván thật: 0.1. 0 đến 1.",
    ),
    (
        "fit.seed",
        "Phương pháp của bài báo: số khởi tạo cho các lựa chọn ngẫu nhiên. Từ 0 trở lên.",
    ),
    (
        "fit.spaced_points",
        "Phương pháp của bài báo: số điểm được chọn cách đều. 3 đến 100000; bài báo không nêu giá trị.",
    ),
    (
        "fit.spacing",
        "Phương pháp của bài báo: khoảng cách giữa các điểm đó so với kích thước bản quét. 0.000001 đến 1; bài báo không nêu giá trị.",
    ),
    (
        "fit.ransac_draws",
        "Phương pháp của bài báo: số lần rút mẫu của RANSAC. 1 đến 100000.",
    ),
    (
        "fit.ransac_distance",
        "Phương pháp của bài báo: khoảng cách mà trong đó một điểm được RANSAC tính là khớp, so với kích thước bản quét. 0.000001 đến 1.",
    ),
    (
        "depth.resolution_by",
        "Cách xác định cỡ của một điểm ảnh: \"longest_side\" (theo cạnh dài nhất) hoặc \"px_per_mm\" (theo milimét, cần biết đơn vị của bản quét).",
    ),
    (
        "depth.longest_px",
        "Cạnh dài nhất của bản đồ độ sâu, tính bằng điểm ảnh; gấp đôi khung để giữ các nét mảnh. 32 đến 16384.",
    ),
    (
        "depth.px_per_mm",
        "Số điểm ảnh trên một milimét. 0.001 đến 10000.",
    ),
    (
        "normalize.canvas_px",
        "Cạnh của khung vuông, tính bằng điểm ảnh. 64 đến 2048.",
    ),
    (
        "normalize.character_px",
        "Cạnh dài nhất của chữ in trong khung, tính bằng điểm ảnh; phần lề dành cho các nét khác nhau. 32 đến 2048.",
    ),
    (
        "normalize.print_grey",
        "Phương pháp của bài báo: mức xám mà dưới đó một điểm ảnh của bản in là mực; bài báo dùng 100 đến 127. 0 đến 255.",
    ),
    (
        "normalize.density_greys",
        "Phương pháp của bài báo: mức xám đầu và cuối được thử làm ngưỡng theo mật độ. 0 đến 255.",
    ),
    (
        "normalize.structure_greys",
        "Phương pháp của bài báo: mức xám đầu và cuối được thử làm ngưỡng theo cấu trúc. 0 đến 255.",
    ),
    (
        "normalize.window",
        "Phương pháp của bài báo: cửa sổ của điểm cấu trúc, \"gaussian\" (Wang và cộng sự 2004) hoặc \"uniform7\".",
    ),
    (
        "register.scale_band",
        "Tỉ số lớn nhất, lên hoặc xuống, giữa cỡ của bản in và của bản đồ độ sâu mà phép tìm tư thế thử. 1 đến 2.",
    ),
    (
        "register.working_px",
        "Cỡ làm việc khi tinh chỉnh, tính bằng điểm ảnh dọc theo chữ. 32 đến 1024.",
    ),
    (
        "register.smoothing_px",
        "Độ làm mịn khi tinh chỉnh, tính bằng điểm ảnh làm việc. 0 đến 10.",
    ),
    (
        "register.anisotropic_scale",
        "Tư thế có được co giãn mặt khắc khác nhau theo hai trục không, nếu bản in cho thấy như vậy: giấy co 1 đến 4 % ngang thớ, và ảnh được chụp nghiêng. true hoặc false.",
    ),
    (
        "register.threshold_min",
        "Độ sâu nhỏ nhất dưới đỉnh nét được thử làm ngưỡng, so với độ nổi. 0 đến 1. Độ đo \"relief\" không tìm: ngưỡng của nó là nơi các đỉnh nét kết thúc.",
    ),
    (
        "register.threshold_max",
        "Độ sâu lớn nhất dưới đỉnh nét được thử làm ngưỡng, so với độ nổi. 0 đến 1. Độ đo \"relief\" không tìm: ngưỡng của nó là nơi các đỉnh nét kết thúc.",
    ),
    (
        "register.min_confidence",
        "Cặp có xác suất tư thế đúng thấp hơn mức này bị từ chối: bản in của chữ khác, bản quét bị lật gương. 0 là không từ chối cặp nào. 0 đến 1. Đây là độ tin cậy của tư thế; độ tin cậy của kết quả còn xét mặt nạ nên có thể thấp hơn. Mức này được hiệu chỉnh trên dữ liệu có bốn trong mười cặp sai; nếu chỉ một trong hai mươi cặp sai thì 0.3 ứng với 0.85.",
    ),
    (
        "register.window",
        "Cửa sổ của SSIM trong điểm số và trong ngưỡng của \"nl_ssim\": \"gaussian\" (Wang và cộng sự 2004) hoặc \"uniform7\" (mặc định của scikit-image).",
    ),
    (
        "register.coarse_angles",
        "Phương pháp của bài báo: số góc trên cả vòng tròn được thử trước; mã của các tác giả dùng 60. 4 đến 3600.",
    ),
    (
        "register.fine_angles",
        "Phương pháp của bài báo: số góc được thử tiếp trong phạm vi ba bước thô mỗi phía; mã của các tác giả dùng 60. 2 đến 3600.",
    ),
];

/// Returns a text in which large whole numbers such as `86400` and `1e9` are written in groups of digits.
fn with_grouped_numbers(text: &str) -> String {
    let words = text.split(' ').map(|word| {
        let (number, end) = word.split_at(word.trim_end_matches(['.', ',', ';']).len());
        large_number(number).map_or_else(|| word.to_owned(), |number| grouped(number) + end)
    });
    words.collect::<Vec<String>>().join(" ")
}

/// Parses a whole number of at least five digits, or one such as `1e9`.
fn large_number(text: &str) -> Option<u64> {
    let (digits, zeros) = text.split_once('e').unwrap_or((text, "0"));
    let number = digits.parse::<u64>().ok()?;
    let number = number.checked_mul(10_u64.checked_pow(zeros.parse().ok()?)?)?;
    (number >= 10_000).then_some(number)
}

impl Visit {
    /// Returns what a setting means, with its unit, range and reason, and the language of the text.
    pub(super) fn setting(&self, key: &str) -> (String, Language) {
        let mut known = VIETNAMESE.iter().filter(|(known, _)| *known == key);
        match (self.language, known.next()) {
            (Language::Vietnamese, Some((_, text))) => {
                (with_grouped_numbers(text), Language::Vietnamese)
            }
            _ => (
                with_grouped_numbers(&explanation(key).join(" ")),
                Language::English,
            ),
        }
    }

    /// Returns what a section of settings is about, or its name if that is not known.
    pub(super) fn setting_section<'n>(&self, name: &'n str) -> &'n str {
        match name {
            "limits.mesh" => self.t("Limits of scans", "Giới hạn của bản quét"),
            "limits.image" => self.t("Limits of images", "Giới hạn của hình"),
            "run" => self.t("Runs", "Lần chạy"),
            "pipeline" => self.t("Method", "Phương pháp"),
            "fit" => self.t("Fit of the carved face", "Khớp mặt khắc"),
            "depth" => self.t("Depth map", "Bản đồ độ sâu"),
            "normalize" => self.t("Separation of the strokes", "Tách nét"),
            "register" => self.t("Registration with the print", "Căn chỉnh với bản in"),
            other => other,
        }
    }

    /// Says where the value of a setting comes from. `None` if it is the default.
    pub(super) fn origin(&self, origin: &Origin) -> Option<String> {
        let name = one_line(&origin.to_string()).into_owned();
        match (origin, self.language) {
            (Origin::Default, _) => None,
            (Origin::Preset(preset), Language::Vietnamese) => {
                Some(format!("bộ thiết lập {preset}"))
            }
            (Origin::File(_), Language::English) => Some(format!("from {name}")),
            (Origin::File(_), Language::Vietnamese) => Some(format!("từ {name}")),
            (Origin::Env(_), Language::Vietnamese) => Some(format!("biến môi trường {name}")),
            (Origin::Preset(_) | Origin::Env(_) | Origin::Flag, _) => Some(name),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::PathBuf;

    use super::{VIETNAMESE, is_hidden, with_grouped_numbers};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_config::{Origin, Sources, explanation, load};

    /// Returns the numbers in a text, such as `0.85` and `1e15`.
    fn numbers(text: &str) -> BTreeSet<&str> {
        let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '.');
        let words = words.map(|word| word.trim_matches('.'));
        words
            .filter(|word| word.starts_with(|c: char| c.is_ascii_digit()))
            .collect()
    }

    #[test]
    fn every_setting_of_the_page_is_explained_in_vietnamese_with_its_numbers() {
        let settings = load(&Sources::default()).expect("the defaults").tree;
        let keys = settings.settings().into_iter().map(|setting| setting.key);
        let shown: BTreeSet<String> = keys.filter(|key| !is_hidden(key)).collect();
        let translated = VIETNAMESE.iter().map(|(key, _)| (*key).to_owned());
        assert_eq!(translated.collect::<BTreeSet<_>>(), shown);
        for (key, text) in VIETNAMESE {
            let english = explanation(key).join(" ");
            let with_points = text.replace(',', ".");
            let missing: Vec<_> = numbers(&english)
                .difference(&numbers(&with_points))
                .map(|number| (*number).to_owned())
                .collect();
            assert!(missing.is_empty(), "{key}: {missing:?} of {english:?}");
        }
    }

    #[test]
    fn large_numbers_are_written_in_groups() {
        let text = "từ 1 đến 86400; tối đa 1e9. Mã e1, 0.5, 1024 và 30000_x.";
        let expected = "từ 1 đến 86\u{202f}400; tối đa 1\u{202f}000\u{202f}000\u{202f}000. Mã e1, 0.5, 1024 và 30000_x.";
        assert_eq!(with_grouped_numbers(text), expected);
    }

    #[test]
    fn every_section_of_the_page_says_what_it_is_about() {
        let settings = load(&Sources::default()).expect("the defaults").tree;
        let keys = settings.settings().into_iter().map(|setting| setting.key);
        let [english, vietnamese] =
            [Language::English, Language::Vietnamese].map(Visit::in_language);
        for key in keys.filter(|key| !is_hidden(key)) {
            let (section, _) = key.rsplit_once('.').expect("a section");
            let texts = [&english, &vietnamese].map(|visit| visit.setting_section(section));
            assert!(texts[0] != texts[1], "{section}");
            assert!(!texts.contains(&section), "{section}");
        }
    }

    #[test]
    fn a_setting_is_explained_in_the_language_of_the_page() {
        let [english, vietnamese] =
            [Language::English, Language::Vietnamese].map(Visit::in_language);
        let (text, language) = vietnamese.setting("run.workers");
        assert!(text.starts_with("Số cặp được tính cùng lúc"), "{text}");
        assert_eq!(language, Language::Vietnamese);
        let (text, language) = english.setting("run.workers");
        assert!(text.starts_with("Pairs worked on"), "{text}");
        assert_eq!(language, Language::English);
        let file = Origin::File(PathBuf::from("p/mocban.toml"));
        assert_eq!(
            vietnamese.origin(&file).as_deref(),
            Some("từ p/mocban.toml")
        );
        assert_eq!(english.origin(&Origin::Default), None);
    }
}
