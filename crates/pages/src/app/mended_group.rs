//! The failed pairs of a class of which files are replaced: which these are, and how their files are named.

use maud::{Markup, html};

use super::address::encoded;
use super::components::grouped;
use super::failure::AppResult;
use super::projects::OpenProject;
use super::visit::Visit;
use mocban_core::domain::{FailureClass, PairName, one_line};

/// Most failures of the class that are looked through for pairs. No project has more.
const SEARCHED: usize = i32::MAX as usize;
/// Most pairs that are named.
const SHOWN: usize = 60;

/// Failed pairs of which files can be replaced.
#[derive(Debug)]
pub(super) struct MendedGroup {
    class: FailureClass,
    /// In the order of import, without pairs that were cut from blocks. Up to one more than are named.
    names: Vec<PairName>,
}

impl MendedGroup {
    /// Reads the pairs of a project that failed with a class.
    pub(super) async fn read(open: &OpenProject, class: FailureClass) -> AppResult<Self> {
        let names = (open.catalog).failed_scans(class, false, [SEARCHED, SHOWN + 1]);
        Ok(Self {
            class,
            names: names.await?,
        })
    }

    /// Names the pairs with links, and says how their files are replaced. `key` names the project.
    pub(super) fn part(&self, visit: &Visit, key: &str) -> Markup {
        let number = self.names.len().min(SHOWN) as u64;
        let has_more = self.names.len() > SHOWN;
        let page = |page: &str| visit.project_page(key, page);
        let all = page(&format!(
            "pairs?view=table&state=failed&class={}",
            self.class
        ));
        html! {
            div.notice #mending {
                @if self.names.is_empty() {
                    p { (visit.t("No failed pair of this kind is left:", "Không còn cặp lỗi nào thuộc loại này:")) " " (visit.class(self.class)) "." }
                } @else {
                    p {
                        b { @if has_more { (visit.t("more than", "hơn")) " " } (grouped(number)) " " (visit.form(number, ["failed pair", "failed pairs"], "cặp lỗi")) }
                        " (" (visit.class(self.class)) "): "
                        @for (index, name) in self.names.iter().take(SHOWN).enumerate() {
                            @if index > 0 { ", " }
                            a href=(page(&format!("pair/{}/", encoded(name.as_str())))) { (one_line(name.as_str())) }
                        }
                        @if has_more { ", …" }
                    }
                    p { (visit.t(
                        "To replace their files: name each new scan or print like its pair, with .ply, .stl or .obj for a scan, and .png, .jpg or .tif for a print, and send only the scans or only the prints here. The page then offers to replace the files of the pairs.",
                        "Để thay tệp của chúng: hãy đặt tên mỗi bản quét hoặc bản in mới như tên cặp, với đuôi .ply, .stl hoặc .obj cho bản quét và .png, .jpg hoặc .tif cho bản in, rồi chỉ gửi các bản quét hoặc chỉ gửi các bản in ở đây. Trang sẽ đề nghị thay tệp của các cặp.",
                    )) }
                    p.row { a href=(all) { (visit.t("Show why each of them failed", "Xem lý do lỗi của từng cặp")) } }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{MendedGroup, SHOWN};
    use crate::app::visit::Visit;
    use crate::review::Language;
    use mocban_core::domain::{FailureClass, PairName};

    fn shown(language: Language, number: usize) -> String {
        let name = |k| PairName::new(&format!("chữ {k}")).expect("a name");
        let group = MendedGroup {
            class: FailureClass::BadInput,
            names: (1..=number).map(name).collect(),
        };
        let visit = Visit::in_language(language);
        group.part(&visit, "p 1").into_string()
    }

    #[test]
    fn the_pairs_of_a_group_are_counted_and_named() {
        for (language, count) in [
            (
                Language::English,
                "<b>3 failed pairs</b> (a file cannot be used): ",
            ),
            (
                Language::Vietnamese,
                "<b>3 cặp lỗi</b> (tệp không dùng được): ",
            ),
        ] {
            let shown = shown(language, 3);
            for part in [
                count,
                "<a href=\"./p/p%201/pair/ch%E1%BB%AF%203/\">chữ 3</a>",
                "./p/p%201/pairs?view=table&amp;state=failed&amp;class=bad_input",
            ] {
                assert!(shown.contains(part), "{part}: {shown}");
            }
        }
    }

    #[test]
    fn a_large_group_names_its_first_pairs_and_an_empty_one_none() {
        let large = shown(Language::English, SHOWN + 1);
        assert!(
            large.contains("<b>more than 60 failed pairs</b>"),
            "{large}"
        );
        assert!(large.contains("chữ 60</a>, …"), "{large}");
        let all = shown(Language::English, SHOWN);
        assert!(all.contains("<b>60 failed pairs</b>"), "{all}");
        assert!(all.contains("chữ 60</a></p>"), "{all}");
        let empty = shown(Language::English, 0);
        assert!(
            empty.contains("No failed pair of this kind is left"),
            "{empty}"
        );
        assert!(!empty.contains("<a "), "{empty}");
    }
}
