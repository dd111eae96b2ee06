//! Numbers of messages are written as in Vietnamese; ids, names of files and values of settings stay.

use super::TABLES;
use super::tests::assert_translated;

/// Words behind a number of things.
const THINGS: [&str; 22] = [
    " %",
    " areas",
    " blocks",
    " boxes",
    " bytes",
    " cells",
    " characters",
    " columns",
    " corners",
    " elements",
    " faces",
    " files",
    " ids",
    " mm",
    " numbers",
    " pages",
    " pairs",
    " points",
    " px",
    " triangles",
    " values",
    " vertices",
];

#[test]
fn numbers_of_things_are_written_as_in_vietnamese() {
    let mut count = 0;
    for (english, vietnamese) in TABLES.into_iter().flatten() {
        for (index, after) in english.split("{}").skip(1).enumerate() {
            let mut things = THINGS.iter();
            if things.any(|thing| after.starts_with(thing)) {
                let place = format!("{{{index}#}}");
                assert!(vietnamese.contains(&place), "{vietnamese:?}: {place}");
                count += 1;
            }
        }
    }
    assert!(count > 60, "{count}");
}

#[test]
fn digits_are_grouped_and_decimals_have_a_comma() {
    assert_translated(&[
        (
            "a.csv: line 1200: the row has 1048615 bytes, over the limit of 1048576",
            "a.csv: dòng 1200: dòng dài 1\u{202f}048\u{202f}615 byte, vượt giới hạn 1\u{202f}048\u{202f}576",
        ),
        (
            "b.json: 1234 of 20000 boxes lie outside the page: box 1",
            "b.json: 1\u{202f}234 trong 20\u{202f}000 khung nằm ngoài trang in: khung 1",
        ),
        (
            "with the unit m, the scan is 1234.5 m long",
            "với đơn vị m, bản quét dài 1\u{202f}234,5 m",
        ),
        (
            "the scans and prints need 12.3 GB in out, and the disk has 900.0 MB",
            "bản quét và bản in cần 12,3 GB trong out, đĩa còn 900,0 MB",
        ),
        (
            "the relief matches the mirrored print better (2.34 times as well as the print itself)",
            "mặt khắc khớp với bản in lật gương hơn (bằng 2,34 lần so với chính bản in)",
        ),
        (
            "similar ids: 1.5, 2.5 and 1234 more",
            "mã gần giống: 1.5, 2.5 và 1\u{202f}234 mục khác",
        ),
    ]);
}

#[test]
fn ids_names_of_files_and_values_of_settings_stay() {
    assert_translated(&[
        ("there is no pair 1.5", "không có cặp 1.5"),
        ("id 10000 is already on line 3", "mã 10000 đã có ở dòng 3"),
        (
            "1.5.csv: line 2: mesh 10000 of 2.5 does not exist",
            "1.5.csv: dòng 2: không có bản quét 10000 của 2.5",
        ),
        (
            "fit.seed = 10000.5 is not a whole number from 0",
            "fit.seed = 10000.5 không phải là số nguyên từ 0 trở lên",
        ),
        ("block 2.5 has no pairs yet", "ván 2.5 chưa có cặp nào"),
    ]);
}
