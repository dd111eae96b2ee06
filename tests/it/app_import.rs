//! The page of imports by raw requests: pairs that a person changes, columns that a person names, and what was shown.

use std::path::Path;

use mocban::workbook::test_helpers::{text_rows, workbook};
use serde_json::{Value, json};

use crate::app::{act, text, with_project};
use crate::app_uploads::encode;
use crate::cli::{mocban, status};
use crate::page::{Page, Reply};

/// Copies inputs of the shared project to other names.
pub(crate) fn copy_inputs(dir: &Path, files: &[(&str, &str)]) {
    for (from, to) in files {
        let (from, to) = (dir.join("p/data").join(from), dir.join(to));
        std::fs::create_dir_all(to.parent().expect("a folder")).expect("created");
        let copied = std::fs::copy(&from, to);
        assert!(copied.is_ok(), "{}: {copied:?}", from.display());
    }
}

/// Opens the page of imports for two folders.
pub(crate) fn folders(page: &Page, dir: &Path, query: &str) -> String {
    let folder = |name: &str| encode(dir.join(name).to_str().expect("UTF-8"));
    let [meshes, prints] = [folder("x/scans"), folder("x/prints")];
    let address = format!("/import?project=new&meshes={meshes}&prints={prints}{query}");
    text(&page.get(&address))
}

/// Returns the fields of the form that imports, as a browser sends them.
fn fields(html: &str) -> Value {
    let form = html.split("actions/import\"").nth(1).expect("a form");
    let form = form.split("</form>").next().expect("its end");
    let mut fields = json!({"project": "new"});
    for input in form.split("<input type=\"hidden\" name=\"").skip(1) {
        let (name, rest) = input.split_once("\" value=\"").expect("a value");
        let value = rest.split('"').next().expect("its end");
        let value = value.replace("&quot;", "\"").replace("&amp;", "&");
        fields[name] = json!(value);
    }
    fields
}

fn import(page: &Page, fields: &Value) -> Reply {
    act(page, "/actions/import", fields, |_| {})
}

/// Returns ids and prints of a project.
fn stored(dir: &Path) -> Vec<(String, String)> {
    let status = mocban(&dir.join("new"), &["status", "--pairs", "--json"]).expect(0);
    let status = status.json();
    let pairs = status["pair_list"].as_array().expect("pairs").iter();
    let print = |pair: &Value| {
        let id = pair["id"].as_str().expect("an id").to_owned();
        let shown = mocban(&dir.join("new"), &["show", &id, "--json"]).expect(0);
        let print = shown.json()["print_path"].to_string();
        (id, print)
    };
    pairs.map(print).collect()
}

const INPUTS: [(&str, &str); 6] = [
    ("meshes/upright-0000.ply", "x/scans/a 1.ply"),
    ("meshes/upright-0001.ply", "x/scans/2.ply"),
    ("meshes/upright-0001.ply", "x/scans/3.ply"),
    ("prints/upright-0000.jpg", "x/prints/chữ.jpg"),
    ("prints/upright-0001.jpg", "x/prints/2.jpg"),
    ("prints/upright-0001.jpg", "x/prints/3.jpg"),
];

#[test]
fn a_person_joins_files_and_leaves_pairs_out_before_the_import() {
    let (dir, page) = with_project();
    let dir = dir.path();
    copy_inputs(dir, &INPUTS);
    let plain = folders(&page, dir, "");
    assert!(plain.contains("<b>2</b> pairs"), "{plain}");
    for option in ["<option value=\"a 1.ply\"", "<option value=\"chữ.jpg\""] {
        assert!(plain.contains(option), "{option}: {plain}");
    }
    let change = format!(
        "&scan={}&print={}&leave=3",
        encode("a 1.ply"),
        encode("chữ.jpg")
    );
    let changed = folders(&page, dir, &change);
    assert!(changed.contains("<b>2</b> pairs"), "{changed}");
    assert!(changed.contains("joined: a 1.ply + chữ.jpg"), "{changed}");
    assert!(changed.contains("left out: 3"), "{changed}");
    assert!(changed.contains("joined by you"), "{changed}");
    // The files of the pair that was left out can be joined otherwise.
    assert!(changed.contains("<option value=\"3.ply\""), "{changed}");
    assert!(!dir.join("new").exists(), "nothing is stored before");
    let fields = fields(&changed);
    let again = folders(
        &page,
        dir,
        &format!(
            "&matches={}",
            encode(fields["matches"].as_str().expect("changes"))
        ),
    );
    assert!(again.contains("joined: a 1.ply + chữ.jpg"), "{again}");
    let reply = import(&page, &fields);
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let pairs = stored(dir);
    let ids: Vec<&str> = pairs.iter().map(|(id, _)| id.as_str()).collect();
    assert_eq!(ids, ["2", "a 1"]);
    assert!(pairs[1].1.contains("chữ.jpg"), "{pairs:?}");
}

#[test]
fn folders_without_a_pair_can_be_mended_too() {
    let (dir, page) = with_project();
    let dir = dir.path();
    copy_inputs(dir, &[INPUTS[0], INPUTS[3]]);
    let none = folders(&page, dir, "");
    assert!(none.contains("<b>0</b> pairs"), "{none}");
    assert!(none.contains("no mesh has the same file name"), "{none}");
    assert!(none.contains("id=\"import\" disabled"), "{none}");
    let refused = import(&page, &fields(&none));
    assert_eq!(refused.status, 422, "{}", text(&refused));
    let change = format!("&scan={}&print={}", encode("a 1.ply"), encode("chữ.jpg"));
    let joined = folders(&page, dir, &change);
    assert!(joined.contains("<b>1</b> pair"), "{joined}");
    let wrong = folders(
        &page,
        dir,
        &format!("&scan={}&print=x.jpg", encode("../a 1.ply")),
    );
    assert!(
        wrong.contains("there is no such mesh without a print"),
        "{wrong}"
    );
    assert!(wrong.contains("&amp;split=0"), "a way back: {wrong}");
    let unknown = page.get("/import?matches=x&language=vi");
    assert_eq!(unknown.status, 422);
    assert!(text(&unknown).contains("địa chỉ này không phải do trang tạo ra"));
    page.get("/?language=en");
}

#[test]
fn one_scan_and_its_page_are_imported_as_a_whole_block() {
    let (dir, page) = with_project();
    let dir = dir.path();
    copy_inputs(
        dir,
        &[
            ("meshes/upright-0000.ply", "x/scans/b04.ply"),
            ("prints/upright-0000.jpg", "x/prints/page 4.jpg"),
        ],
    );
    let alone = folders(&page, dir, "");
    for part in ["id=\"join\"", "id=\"whole-block\""] {
        assert!(alone.contains(part), "{part}: {alone}");
    }
    let block = folders(&page, dir, "&whole_block=yes");
    for part in [
        "<b>1</b> whole block",
        "<th scope=\"row\">b04</th>",
        "page 4.jpg",
    ] {
        assert!(block.contains(part), "{part}: {block}");
    }
    let reply = import(&page, &fields(&block));
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let blocks = text(&page.get("/p/new/blocks"));
    assert!(blocks.contains("href=\"block/b04/\""), "{blocks}");

    let line =
        r#"{"block":"b04","mesh":"scans/b04.ply","page":"prints/page 4.jpg","shelfmark":"R.4"}"#;
    let list = dir.join("x/blocks.jsonl");
    std::fs::write(&list, line).expect("written");
    let project = dir.join("new");
    mocban(&project, &["import", list.to_str().expect("UTF-8")]).expect(0);
    let again = import(&page, &fields(&folders(&page, dir, "&whole_block=yes")));
    assert_eq!(again.status, 200, "{}", text(&again));
    let shown = mocban(&project, &["show", "b04", "--json"]).expect(0);
    assert_eq!(shown.json()["meta"], json!({ "shelfmark": "R.4" }));
}

#[test]
fn an_import_is_refused_if_the_files_changed_after_they_were_shown() {
    let (dir, page) = with_project();
    let dir = dir.path();
    copy_inputs(dir, &INPUTS);
    let shown = fields(&folders(&page, dir, ""));
    copy_inputs(dir, &[("prints/upright-0000.jpg", "x/prints/a 1.jpg")]);
    let refused = import(&page, &shown);
    assert_eq!(refused.status, 422);
    assert!(
        text(&refused).contains("changed after the pairs were shown"),
        "{}",
        text(&refused)
    );
    assert!(!dir.join("new").exists(), "nothing is stored");
    page.get("/?language=vi");
    let refused = import(&page, &shown);
    assert!(
        text(&refused).contains("hãy tải lại trang"),
        "{}",
        text(&refused)
    );
    let translated = folders(&page, dir, "");
    assert!(
        translated.contains("Bỏ qua, bản in không có bản quét: "),
        "{translated}"
    );
    page.get("/?language=en");
    let now = fields(&folders(&page, dir, ""));
    // The unit is chosen in the form itself.
    let mut with_unit = now.clone();
    with_unit["unit"] = json!("mm");
    let reply = import(&page, &with_unit);
    assert_eq!(reply.status, 200, "{}", text(&reply));
    assert_eq!(stored(dir).len(), 3);
    let mut wrong = now;
    wrong["shown"] = json!("0");
    assert_eq!(import(&page, &wrong).status, 422);
}

#[test]
fn blocks_with_the_same_files_are_named_before_the_import() {
    let (dir, page) = with_project();
    let file = dir.path().join("blocks.csv");
    let rows = "block,mesh,page\na,a.stl,a.png\nb,a.stl,a.png\n";
    std::fs::write(&file, rows).expect("written");
    let list = encode(file.to_str().expect("UTF-8"));
    for (language, sentence) in [
        (
            "en",
            "blocks with the same scan and page as an earlier one: 1, first b, as on line 2",
        ),
        (
            "vi",
            "số ván có cùng bản quét và trang in với một ván trước: 1, ván đầu tiên là b, giống dòng 2",
        ),
    ] {
        page.get(&format!("/?language={language}"));
        let shown = text(&page.get(&format!("/import?project=new&list={list}")));
        assert!(shown.contains(sentence), "{shown}");
    }
}

#[test]
fn a_person_names_the_columns_of_a_list() {
    let (dir, page) = with_project();
    let dir = dir.path();
    copy_inputs(dir, &INPUTS);
    let rows = [
        ["Nr", "Model", "Image", "Zeichen"],
        ["n1", "scans/2.ply", "prints/2.jpg", "明"],
        ["n2", "scans/3.ply", "prints/3.jpg", ""],
    ];
    let csv = rows.map(|row| row.join(";")).join("\n");
    std::fs::write(dir.join("x/list.csv"), csv).expect("written");
    let cells = rows.each_ref().map(<[&str; 4]>::as_slice);
    let sheet = workbook(&[("Sheet1", &text_rows(&cells))], "", "");
    std::fs::write(dir.join("x/list.xlsx"), sheet).expect("written");
    // The command line names the same columns.
    let refused = mocban(dir, &["-C", "new", "import", "x/list.csv"]).expect(2);
    assert!(
        refused.err.contains("column \"id\" is missing"),
        "{}",
        refused.err
    );
    for (file, project) in [("x/list.csv", "new"), ("x/list.xlsx", "other")] {
        let list = encode(dir.join(file).to_str().expect("UTF-8"));
        let page_of =
            |query: &str| text(&page.get(&format!("/import?project={project}&list={list}{query}")));
        let asked = page_of("");
        assert!(asked.contains("Choose them:"), "{asked}");
        assert!(asked.contains("<td>scans/2.ply</td>"), "{asked}");
        assert!(
            asked.contains("<select name=\"character_column\">"),
            "{asked}"
        );
        assert!(!asked.contains("is missing"), "said once: {asked}");
        let columns = "&id_column=Nr&mesh_column=Model&print_column=Image&character_column=Zeichen";
        let chosen = page_of(columns);
        assert!(chosen.contains("<b>2</b> pairs"), "{chosen}");
        assert!(chosen.contains("明"), "{chosen}");
        let left_out = page_of(&format!("{columns}&leave=n2"));
        assert!(left_out.contains("<b>1</b> pair"), "{left_out}");
        let mut fields = fields(&left_out);
        fields["project"] = json!(project);
        let reply = import(&page, &fields);
        assert_eq!(reply.status, 200, "{}", text(&reply));
        assert_eq!(status(&dir.join(project))["pairs"], 1);
        let wrong = page_of("&id_column=Number&mesh_column=Model&print_column=Image");
        assert!(wrong.contains("there is no column"), "{wrong}");
        assert!(!wrong.contains("Choose them:"), "said once: {wrong}");
        let twice = page_of("&id_column=Nr&mesh_column=Nr");
        assert!(twice.contains("is chosen for two columns"), "{twice}");
    }
}

#[test]
fn all_pairs_can_be_looked_at_before_the_import() {
    let (dir, page) = with_project();
    let dir = dir.path();
    for number in 0..45 {
        for (folder, ending) in [("scans", "stl"), ("prints", "png")] {
            let file = dir.join(format!("x/{folder}/{number}.{ending}"));
            std::fs::create_dir_all(file.parent().expect("a folder")).expect("created");
            std::fs::write(file, "x").expect("written");
        }
    }
    let row = |number: usize| format!("<th scope=\"row\">{number}</th>");
    let first = folders(&page, dir, "");
    assert!(
        first.contains(&row(19)) && !first.contains(&row(20)),
        "{first}"
    );
    assert!(first.contains("from=20"), "{first}");
    let last = folders(&page, dir, "&from=40&leave=3");
    assert!(
        last.contains(&row(44)) && !last.contains(&row(39)),
        "{last}"
    );
    assert!(last.contains("<b>44</b> pairs"), "{last}");
    let past = folders(&page, dir, "&from=60");
    assert!(past.contains(&row(44)), "the last page: {past}");
}

#[test]
fn a_list_for_a_known_project_is_compared_before_it_erases_columns() {
    let (dir, page) = with_project();
    let list = dir.path().join("short.csv");
    let data = dir.path().join("p/data");
    let path = |name: &str| data.join(name).display().to_string();
    let [mesh, print] = ["meshes/upright-0000.ply", "prints/upright-0000.jpg"].map(path);
    std::fs::write(
        &list,
        format!("id,mesh,print\nupright-0000,{mesh},{print}\n"),
    )
    .expect("written");
    let block = || {
        let shown = mocban(&dir.path().join("p"), &["show", "upright-0000", "--json"]);
        shown.expect(0).json()["block"].clone()
    };
    assert_eq!(block(), "upright-block-01");
    let list = list.to_str().expect("UTF-8");
    let html = text(&page.get(&format!("/import?list={}", encode(list))));
    let mut chosen = fields(&html);
    // The page has compared the list with no project; the name is typed below it.
    chosen["project"] = json!("p");
    let reply = import(&page, &chosen);
    let go = reply.json()["go"].clone();
    let go = go.as_str().expect("an address");
    assert!(go.starts_with("import?project=p&compare=1&list="), "{go}");
    assert_eq!(block(), "upright-block-01");
    let shown = text(&page.get(&format!("/{go}")));
    assert!(shown.contains("Nothing was imported yet"), "{shown}");
    assert!(shown.contains("Pairs that lose their block"), "{shown}");
    let mut seen = fields(&shown);
    seen["project"] = json!("p");
    let reply = import(&page, &seen);
    assert_eq!(reply.json()["go"], "p/p/", "{}", text(&reply));
    assert_eq!(block(), Value::Null);
}

#[test]
fn a_change_that_is_refused_leaves_what_was_chosen() {
    let (dir, page) = with_project();
    let meshes = dir.path().join("p/data/meshes");
    let meshes = encode(meshes.to_str().expect("UTF-8"));
    let leave = "x".repeat(5000);
    for (language, part) in [
        ("en", "too many pairs are changed for one import"),
        ("vi", "quá nhiều cặp được thay đổi trong một lần nhập"),
    ] {
        let path = format!("/import?meshes={meshes}&leave={leave}&language={language}");
        let html = text(&page.get(&path));
        for part in [part, "p/data/meshes</code>"] {
            assert!(html.contains(part), "{part}: {html}");
        }
    }
}

#[test]
fn pairs_without_a_block_get_the_typed_one() {
    let (dir, page) = with_project();
    let dir = dir.path();
    copy_inputs(dir, &INPUTS);
    let shown = folders(&page, dir, "");
    let field = "<input id=\"block\" name=\"block\" value=\"\"";
    assert!(shown.contains(field), "{shown}");
    let mut typed = fields(&shown);
    typed["block"] = json!("v".repeat(61));
    let refused = import(&page, &typed);
    assert_eq!(refused.status, 422, "{}", text(&refused));
    assert!(!dir.join("new").exists(), "nothing is stored");
    typed["block"] = json!(" Ván 9 ");
    let reply = import(&page, &typed);
    assert_eq!(reply.status, 200, "{}", text(&reply));
    let pair = mocban(&dir.join("new"), &["show", "2", "--json"]).expect(0);
    assert_eq!(pair.json()["block"], "Ván 9");
    // The list of the shared project has a column for blocks.
    let list = encode(dir.join("p/data/manifest.csv").to_str().expect("UTF-8"));
    let listed = text(&page.get(&format!("/import?project=new&list={list}")));
    assert!(listed.contains("id=\"import\""), "{listed}");
    assert!(!listed.contains("id=\"block\""), "{listed}");
}
