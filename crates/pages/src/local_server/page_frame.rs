//! HTML that all pages share: the frame of a document, and the pages without a session.

use maud::{DOCTYPE, Markup, html};

use super::access_control::Entrance;
use super::session::{ICON, SESSION_SCRIPT, SESSION_STYLE, START};

/// Returns a whole document. `body` is the `body` element.
pub fn document(language: &str, title: &str, head: &Markup, body: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang=(language) {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                link rel="icon" href=(ICON);
                (head)
            }
            (body)
        }
    }
}

/// Returns the page at the start address. Its script remembers the path of the session and opens it.
pub(super) fn forward_page(path: &str) -> Markup {
    let address = format!("{path}/");
    with_script(&html! {
        body data-session=(address) {
            main {
                h1 { "mocban" }
                p { a href=(address) { "Open the page" } }
                p lang="vi" { a href=(address) { "Mở trang" } }
            }
        }
    })
}

/// Returns the page at the link of an invitation. Its button opens the session.
pub(super) fn welcome_page(token: &str) -> Markup {
    document(
        "en",
        "mocban",
        &html! { link rel="stylesheet" href=(SESSION_STYLE); },
        &html! {
            body {
                main {
                    h1 { "You are invited to judge alignments" }
                    p { "The link works once, in this browser. You can stop at any time and continue later." }
                    div lang="vi" {
                        h1 { "Bạn được mời đánh giá kết quả căn chỉnh" }
                        p { "Liên kết dùng được một lần, trong trình duyệt này. Bạn có thể dừng bất cứ lúc nào và tiếp tục sau." }
                    }
                    form method="post" action={ (START) "?token=" (token) } {
                        button { "Begin / " span lang="vi" { "Bắt đầu" } }
                    }
                }
            }
        },
    )
}

/// Returns the page for a browser without a session. Its script opens the session that the browser remembers, for an
/// invitation only that of its place.
pub(super) fn closed_page(entrance: &Entrance) -> Markup {
    let [english, vietnamese] = match entrance {
        Entrance::Command => [
            "Open the address that the command printed. It works once, in one browser. If it has been used, end the command \
             with Ctrl-C and run it again to get a new one: nothing is lost.",
            "Hãy mở địa chỉ mà lệnh đã in ra. Địa chỉ chỉ dùng được một lần, trong một trình duyệt. Nếu địa chỉ đã được sử \
             dụng, hãy dừng lệnh bằng Ctrl-C rồi chạy lại để nhận địa chỉ mới: không mất gì cả.",
        ],
        Entrance::Invitation { .. } => [
            "Open the link of your invitation. It works once, in one browser. If it has been used, or was withdrawn, ask the \
             person who invited you for a new one, and open it in this browser. The answers that were sent are stored.",
            "Hãy mở liên kết trong lời mời. Liên kết chỉ dùng được một lần, trong một trình duyệt. Nếu liên kết đã được sử \
             dụng hoặc đã bị thu hồi, hãy xin người mời một liên kết mới và mở nó trong trình duyệt này. Các câu trả lời đã \
             gửi vẫn được lưu.",
        ],
    };
    let place = entrance.place();
    with_script(&html! {
        body data-place=[(!place.is_empty()).then_some(place)] data-guest[matches!(entrance, Entrance::Invitation { .. })] {
            main {
                h1 { "This page is not open in this browser" }
                p { (english) }
                div lang="vi" {
                    h1 { "Trang này chưa được mở trong trình duyệt này" }
                    p { (vietnamese) }
                }
            }
        }
    })
}

fn with_script(body: &Markup) -> Markup {
    let head = html! {
        link rel="stylesheet" href=(SESSION_STYLE);
        script type="module" src=(SESSION_SCRIPT) {}
    };
    document("en", "mocban", &head, body)
}

#[cfg(test)]
mod tests {
    use super::{Entrance, closed_page, forward_page, welcome_page};

    #[test]
    fn pages_without_a_session() {
        let guest = Entrance::Invitation {
            place: "0123456789abcdef".to_owned(),
        };
        let pages = [
            forward_page("/s/12ab"),
            closed_page(&Entrance::Command),
            closed_page(&guest),
            welcome_page("34cd"),
        ];
        let pages = pages.map(|page| page.into_string().replace("><", ">\n<"));
        insta::assert_snapshot!(pages.join("\n\n"));
    }
}
