//! Tests of the reader of XYZ point sets.

use crate::mesh::{Mesh, MeshError, MeshLimits, Vertices, read, read_from};

pub(super) fn open(text: &str) -> Result<Mesh, MeshError> {
    read(text.as_bytes(), "scan.xyz", &MeshLimits::SUGGESTED)
}

pub(super) fn refused(text: &str) -> String {
    open(text).expect_err(text).to_string()
}

const POINTS: [[f64; 3]; 2] = [[1.0, 2.5, 3.0], [4.0, 5.0, 6.25]];

fn assert_points(text: &str) {
    let mesh = open(text).unwrap_or_else(|error| panic!("{error}: {text}"));
    assert_eq!(mesh.vertices, POINTS.to_vec().into(), "{text}");
    assert!(mesh.triangles.is_empty());
}

#[test]
fn titles_counts_comments_and_further_columns_are_ignored() {
    for text in [
        "1 2.5 3\n4 5 6.25\n",
        "2\n1 2.5 3 255 0 0\n4 5 6.25 255 0 0\n",
        "x,y,z,nx\n1,2.5,3,0\n4,5,6.25,0\n",
        "# scan\n\n1;2.5;3\n4;5;6.25",
        "//X Y Z\n1\t2.5\t3\n4\t5\t6.25\n",
        "% made by a scanner, 2 points\n1 2.5 3\n% more\n4 5 6.25\n",
        "\"X\",\"Y\",\"Z\"\n1,2.5,3\n4,5,6.25\n",
        "\"scan of block 4\"\n2\nX [mm] Y [mm] Z [mm]\n1 2.5 3\n4 5 6.25\n",
        "X (mm);Y (mm);Z (mm)\n1;2.5;3\n4;5;6.25\n",
        "x_mm,y_mm,z_mm\n1,2.5,3\n4,5,6.25\n",
        "X Y Z\nmm mm mm\n1 2.5 3\n4 5 6.25\n",
        "X\tY\tZ\n[mm]\t[mm]\t[mm]\n1\t2.5\t3\n4\t5\t6.25\n",
        "# the axes are x y z\n1 2.5 3 0 0 0\n4 5 6.25 0 0 0\n",
    ] {
        assert_points(text);
    }
}

#[test]
fn a_count_may_precede_each_scan_and_an_end_mark_may_follow() {
    for text in [
        "1\n1 2.5 3\n1\n4 5 6.25\n",
        "1\n1 2.5 3 -20 255 0 0\n1\n4 5 6.25 -20 255 0 0\n",
        "1\n1;2,5;3\n1\n4;5;6,25\n",
        "1\n1\t2.5\t3\n1\n4\t5\t6.25\n",
        "1 2.5 3\n4 5 6.25\n\x1a",
        "1 2.5 3\r\n4 5 6.25\r\n\x1a\r\n",
        "1 2.5 3\n4 5 6.25\x1a\x1a",
    ] {
        assert_points(text);
    }
    for text in ["2\n1 2.5 3\n1\n4 5 6.25\n", "1 2.5 3\n1\n4 5 6.25\n"] {
        let said = refused(text);
        assert!(said.ends_with(": 1 of 3 coordinates"), "{said}");
    }
}

#[test]
fn columns_are_those_that_the_title_names() {
    for text in [
        "z,y,x\n3,2.5,1\n6.25,5,4\n",
        "ID X Y Z\n7 1 2.5 3\n3 4 5 6.25\n",
        "# id x y z\n7 1 2.5 3\n3 4 5 6.25\n",
        "Point ID,X,Y,Z\n7,1,2.5,3\n3,4,5,6.25\n",
        "r;g;b;X;Y;Z\n0;0;0;1;2,5;3\n0;0;0;4;5;6,25\n",
        "Nr;Rechts;Hoch;Höhe\n7;1;2,5;3\n3;4;5;6,25\n",
        "E,N,H\n1,2.5,3\n4,5,6.25\n",
        "n e h\n2.5 1 3\n5 4 6.25\n",
        "n e n h\n7 1 2.5 3\n3 4 5 6.25\n",
        "Northing,Easting,Elevation\n2.5,1,3\n5,4,6.25\n",
        "# t x y z\n0.5 1 2.5 3\n0.25 4 5 6.25\n",
        "// scan x y z\n7 1 2.5 3\n3 4 5 6.25\n",
        "# scan row col x y z\n1 7 8 1 2.5 3\n1 3 9 4 5 6.25\n",
        "# columns: x y z\n1 2.5 3 7\n4 5 6.25 3\n",
        "# scan: x y z\n1 2.5 3 7\n4 5 6.25 3\n",
        "X [millimeters] Y [millimeters] Z [millimeters]\n1 2.5 3\n4 5 6.25\n",
        "x y z\ninches inches inches\n1 2.5 3\n4 5 6.25\n",
        "x (metre) y (metre) z (metre)\n1 2.5 3\n4 5 6.25\n",
    ] {
        assert_points(text);
    }
    assert_eq!(
        refused("Point number X Y Z\n7 1 2.5 3\n"),
        "line 1: it names 5 columns, but the first point has 4"
    );
}

#[test]
fn a_first_column_of_increasing_numbers_is_no_coordinate() {
    let rows = |row: &dyn Fn(usize) -> String| (0..12).map(row).collect::<Vec<_>>().concat();
    let numbered = rows(&|k| format!("{} {} {} 1.5\n", 3 * k, k % 4, k / 4));
    let plain = rows(&|k| format!("{} {} 1.5\n", k % 4, k / 4));
    assert_eq!(open(&numbered), open(&plain));
    // Three columns are coordinates, and so are numbers that repeat.
    let three = rows(&|k| format!("{k} {} 1.5\n", k % 4));
    let grid = rows(&|k| format!("{} {} 1.5 9\n", k / 2, k % 4));
    let last = |text: &str| open(text).expect("reads").vertices.at(11);
    assert_eq!(
        (last(&three), last(&grid)),
        ([11.0, 3.0, 1.5], [5.0, 3.0, 1.5])
    );
}

#[test]
fn decimal_commas_are_read_as_points() {
    for text in [
        "1,0 2,5 3,0\n4,0 5,0 6,25\n",
        "1 2,5 3\n4 5 6,25\n",
        "1;2,5;3\n4;5;6,25\n",
        "1\t2,50\t3\t0,5\n4\t5\t6,25\t0,5\n",
        "1,0, 2,5, 3,0\n4,0, 5,0, 6,25\n",
        "X;Y;Z\n1,0;2,5;3e0\n4;5;6,25\n",
        // Whole numbers come first.
        "4 5 6\n1,0 2,5 3\n4 5 6,25\n",
    ] {
        let last = text.split_once("4 5 6\n").map_or(text, |(_, rest)| rest);
        assert_points(last);
        let count = open(text).expect(text).vertices.len();
        assert_eq!(
            count,
            text.lines().filter(|line| !line.contains('X')).count(),
            "{text}"
        );
    }
    for text in [
        "1,2.5,3\n4,5,6.25\n",
        "1, 2.5, 3\n4, 5, 6.25",
        "1 ,2.5 ,3\n4 ,5 ,6.25\n",
    ] {
        assert_points(text);
    }
}

#[test]
fn unclear_commas_are_refused() {
    assert_eq!(refused("1,5 2,5\n"), "line 1: 2 of 3 coordinates");
    assert!(refused("1 2 3\n1,000.5 2 3\n").starts_with("line 2: its commas"));
    for text in ["1,000.5 2 3\n", "1,000.5 2,000.5 3,000.5\n", "1 2,5.5 3\n"] {
        assert_eq!(
            refused(text),
            "line 1: its commas may separate numbers or be part of them; write spaces between numbers"
        );
    }
    assert_eq!(
        refused("1,5 2,5 3\n1.5 2 3\n"),
        "line 2: \"1.5\" has a point, but others have a comma; write all numbers with the same decimal mark"
    );
    assert_eq!(
        refused("1,5 2,5 3\n1,234,567 2 3\n"),
        "line 2: \"1,234,567\" is not a number"
    );
}

#[test]
fn a_bad_line_is_named() {
    assert_eq!(refused("1 2 3\n4 5\n"), "line 2: 2 of 3 coordinates");
    assert_eq!(refused("1 2 3\n4 x 6\n"), "line 2: \"x\" is not a number");
    assert_eq!(
        refused("a scan of March\n1 2 3\n"),
        "line 1: \"a\" is not a number"
    );
    assert_eq!(refused("1,\"x\",3\n"), "line 1: \"x\" is not a number");
    assert_eq!(open("0\n"), Err(MeshError::NoVertices));
}

/// Returns the positions of a text, in which NaN stands for a coordinate that is missing, and how many points have none.
fn with_missing(text: &str) -> (Vec<[f64; 3]>, u64) {
    let bytes = text.as_bytes();
    let read = read_from(
        &mut &*bytes,
        bytes.len() as u64,
        "scan.xyz",
        &MeshLimits::SUGGESTED,
    );
    let read = read.unwrap_or_else(|error| panic!("{error}: {text}"));
    let positions = read.mesh.vertices.iter().collect();
    (positions, read.losses.missing_vertices)
}

#[test]
fn an_empty_cell_is_a_missing_coordinate_whatever_separates_cells() {
    for (separator, comma) in [(";", "."), (";", ","), ("\t", "."), ("\t", ","), (",", ".")] {
        for missing in ["1.5||3.5|8", "|2.5|3.5|8", "1.5|2.5||8", "|||8", "|||"] {
            let text = format!("1.5|2.5|3.5|8\n{missing}\n4.5|5.5|6.5|9\n");
            let text = text.replace('.', comma).replace('|', separator);
            assert_eq!(
                with_missing(&text),
                (vec![[1.5, 2.5, 3.5], [4.5, 5.5, 6.5]], 1),
                "{text:?}"
            );
        }
        for missing in ["1.5|2.5|", "||", "1.5||"] {
            let text = format!("{missing}\n1.5|2.5|3.5\n4.5|5.5|6.5\n");
            let text = text.replace('.', comma).replace('|', separator);
            let (positions, count) = with_missing(&text);
            assert_eq!(positions, [[1.5, 2.5, 3.5], [4.5, 5.5, 6.5]], "{text:?}");
            // A line of tabs before all points is empty.
            assert_eq!(
                count,
                u64::from(missing != "||" || separator != "\t"),
                "{text:?}"
            );
        }
    }
}

#[test]
fn the_first_column_of_a_named_tab_file_may_be_empty() {
    let text = "N\tX\tY\tZ\n\t1\t2.5\t3\n\t4\t5\t6.25\n";
    assert_eq!(with_missing(text).0, POINTS);
}

#[test]
fn tabs_and_blanks_that_align_numbers_are_white_space() {
    for text in [
        "1\t\t2.5\t\t3\n4\t\t5\t\t6.25\n",
        "1\t\t2.5\t3\n4\t5\t6.25\n",
        "\t1\t2.5\t3\n\t4\t5\t6.25\n",
        "1 \t2.5 \t3\n4 \t5 \t6.25\n",
        "1 2.5\t3\n4 5\t6.25\n",
        "1\t2.5 3\n4   5\t6.25\n",
        "1\t2.5\t3\t\n4\t5\t6.25\t\n",
    ] {
        assert_points(text);
    }
    let many = "1\t2.5\t3\n".repeat(1000);
    assert_eq!(
        refused(&format!("{many}4\t\t5\t6\n")),
        "line 1001: it has 4 columns between tabs, but others have 3; write one tab between columns"
    );
}

#[test]
fn blanks_within_numbers_are_refused_and_wide_spaces_are_read() {
    let said = |line: u32| {
        format!(
            "line {line}: it has 4 columns, but most lines have 3; write numbers such as \"1 234\" without blanks"
        )
    };
    assert_eq!(
        refused("1,5 2,5 3,5\n4,5 5,5 6,5\n1 234,5 2,5 3,5\n"),
        said(3)
    );
    assert_eq!(
        refused("1.5 2.5 3.5\n4.5 5.5 6.5\n2.5 1 234.5 3.5\n"),
        said(3)
    );
    let many = "1,5;2,5;3,5\n".repeat(1000);
    assert_eq!(refused(&format!("{many}1 234,5;2,5;3,5\n")), said(1001));
    // Lines with a further column are no such lines.
    assert_points("1 2.5 3\n4 5 6.25 255\n");
    for text in [
        "1\u{a0}001,5;2,5;3\n1,5;2,5;3\n",
        "1\u{202f}001.5 2.5 3\n1.5 2.5 3\n",
        "1\u{a0}001,5\t2,5\t3\n1,5\t2,5\t3\n",
        "1001.5\u{a0}2.5\u{a0}3\n1.5 2.5 3\n",
    ] {
        let read = open(text).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(
            read.vertices,
            vec![[1001.5, 2.5, 3.0], [1.5, 2.5, 3.0]].into(),
            "{text}"
        );
    }
}

#[test]
fn blanks_group_digits_between_semicolons_and_tabs() {
    let grouped = "-14 293,45;1 024 808,22;742,5\n1 234;2 345,6;-3 456\n";
    let wanted: Vertices =
        vec![[-14_293.45, 1_024_808.22, 742.5], [1234.0, 2345.6, -3456.0]].into();
    for text in [
        grouped.to_owned(),
        grouped.replace(';', "\t"),
        grouped.replace(',', "."),
        grouped.replace(',', ".").replace(';', "\t"),
        grouped.replace(';', " ; "),
        format!("X;Y;Z\n{grouped}"),
        grouped.replace('\n', ";a b;128\n"),
    ] {
        let read = open(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(read.vertices, wanted, "{text}");
    }
    let (_, missing) = with_missing(&format!("{grouped}1 234;;2\n"));
    assert_eq!(missing, 1);
    assert_eq!(
        refused(&format!("{}1 23;4;5\n", grouped.repeat(500))),
        "line 1001: a cell has a blank, but is not a number such as \"1 234\""
    );
    // Blanks that may do both are refused.
    assert_eq!(
        refused("14 293,45 24 808,22 18 742,57\n14 293,46 24 808,22 18 742,58\n"),
        "line 1: blanks may group the digits of its numbers or separate them; write numbers such as \"1 234.5\" without blanks"
    );
}

#[test]
fn a_named_separator_and_quoted_numbers_are_read() {
    for text in [
        "sep=;\n1;2,5;3\n4;5;6,25\n",
        "sep=,\r\nX,Y,Z\r\n1,2.5,3\r\n4,5,6.25\r\n",
        "SEP=\t\n1\t2.5\t3\n4\t5\t6.25\n",
        "Sep = ;\n1;2,5;3\n4;5;6,25\n",
        "\"sep=;\"\n1;2,5;3\n4;5;6,25\n",
        " \"SEP = ;\" \n\"1,0\";\"2,5\";\"3,0\"\n\"4,0\";\"5,0\";\"6,25\"\n",
        "Sep = ;\n\"1,0\";\"2,5\";\"3,0\"\n\"4,0\";\"5,0\";\"6,25\"\n",
        "\"1,0\",\"2,5\",\"3,0\"\n\"4,0\",\"5,0\",\"6,25\"\n",
        "\"X\",\"Y\",\"Z\"\n\"1\",\"2.5\",\"3\"\n\"4\",\"5\",\"6.25\"\n",
        "sep=,\n1,\"2,5\",3\n4,5,\"6,25\"\n",
        "name,x,y,z\n\"a, b\",1,2.5,3\n\"c\",4,5,6.25\n",
        "\"1,0\";\"2,5\";\"3,0\"\n\"4,0\";\"5,0\";\"6,25\"\n",
        "sep=|\n1|2.5|3\n4|5|6.25\n",
        "sep=|\nX|Y|Z\n1|2,5|3\n4|5|6,25\n",
        "sep=|\n\"1,0\"|\"2,5\"|\"3\"\n\"4\"|\"5\"|\"6,25\"\n",
        "\nsep=:\nsep=:\n1:2.5:3\n4:5:6.25\n",
    ] {
        assert_points(text);
    }
    let (positions, missing) = with_missing("\"1,5\",\"\",\"2\"\n\"1\",\"2,5\",\"3\"\n");
    assert_eq!((positions, missing), (vec![[1.0, 2.5, 3.0]], 1));
    assert_eq!(
        refused("\"1,500\",\"2.5\",\"3\"\n"),
        "line 1: \"2.5\" has a point, but others have a comma; write all numbers with the same decimal mark"
    );
}

#[test]
fn points_and_commas_that_group_digits_are_read_and_others_are_named() {
    let plain = "\"1,5\",\"2,5\",\"3\"\n".repeat(500);
    for (text, last) in [
        (
            format!("{plain}\"1.234,5\",\"2,5\",\"3\"\n"),
            [1234.5, 2.5, 3.0],
        ),
        (
            "\"69.31\",\"1,000.54\",\"2\"\n".to_owned(),
            [69.31, 1000.54, 2.0],
        ),
        (
            "\"500.002,00\",\"2.300.001,50\",\"12,25\"\n".repeat(9),
            [500_002.0, 2_300_001.5, 12.25],
        ),
        (
            "\"1 234,5\";\"2 000\";\"3\"\n".to_owned(),
            [1234.5, 2000.0, 3.0],
        ),
        (
            "1.234,5;2.000,5;3.000,5\n".to_owned(),
            [1234.5, 2000.5, 3000.5],
        ),
        (
            "1,5;2,5;3,5\n1.234,5;2,5;3,5\n".to_owned(),
            [1234.5, 2.5, 3.5],
        ),
    ] {
        let read = open(&text).unwrap_or_else(|error| panic!("{error}: {text}"));
        assert_eq!(read.vertices.at(read.vertices.len() - 1), last, "{text}");
    }
    assert_eq!(
        refused(&format!("{plain}\"1.2.3,5\",\"2,5\",\"3\"\n{plain}")),
        "line 501: \"1.2.3,5\" is not a number"
    );
    assert_eq!(
        refused(&format!("{plain}\"1.5\",\"2,5\",\"3\"\n")),
        "line 501: \"1.5\" has a point, but others have a comma; write all numbers with the same decimal mark"
    );
    assert_eq!(
        refused("\"X\",\"Y\",\"Z\"\n1 2.5 3\n4 x 6\n"),
        "line 3: \"x\" is not a number"
    );
}

#[test]
fn numbers_of_points_in_any_order_are_no_coordinates() {
    let rows = |number: &dyn Fn(usize) -> String| {
        let row = |k: usize| format!("{} {}.5 {} 1.5\n", number(k), k % 4, k / 4);
        (0..12).map(row).collect::<Vec<_>>().concat()
    };
    let plain: Vec<[f64; 3]> = (0..12)
        .map(|k| [(k % 4) as f64 + 0.5, (k / 4) as f64, 1.5])
        .collect();
    let plain: Vertices = plain.into();
    for numbered in [
        rows(&|k| format!("{}", k * 7 % 12)),
        rows(&|k| format!("{k}.0")),
        rows(&|k| format!("{:04}", 11 - k)),
        rows(&|k| format!("{k}"))
            .replace(' ', ";")
            .replace('.', ","),
    ] {
        assert_eq!(
            open(&numbered).expect(&numbered).vertices,
            plain,
            "{numbered}"
        );
    }
}

#[test]
fn a_row_and_a_column_before_coordinates_are_refused_unless_they_are_named() {
    let rows = |more: &str| {
        let row = |k: usize| format!("{} {} {}.25 {}.5 1.5{more}\n", k / 4, k % 4, k % 4, k / 4);
        (0..12).map(row).collect::<Vec<_>>().concat()
    };
    for more in ["", " 128"] {
        assert_eq!(
            refused(&rows(more)),
            "line 1: its first two numbers may be a row and a column, or x and y; name the columns in a line before the points, \
             such as `row col x y z`"
        );
    }
    let named = open(&format!("row col x y z\n{}", rows(""))).expect("reads");
    assert_eq!(named.vertices.at(5), [1.25, 1.5, 1.5]);
    // The number of a scan or a point precedes both.
    let numbers: [fn(usize) -> usize; 3] = [|_| 1, |k| 1 + k / 6, |k| k];
    for number in numbers {
        let lines = rows("");
        let numbered = lines.lines().enumerate();
        let numbered = numbered.map(|(k, line)| format!("{} {line}\n", number(k)));
        let numbered: String = numbered.collect();
        assert_eq!(
            refused(&numbered),
            "line 1: its first three numbers may be those of a scan or point, a row and a column; name the columns in a line before \
             the points, such as `scan row col x y z`"
        );
        let named = open(&format!("scan row col x y z\n{numbered}")).expect("reads");
        assert_eq!(named.vertices.at(5), [1.25, 1.5, 1.5]);
    }
    // Heights on a grid with normals or colours.
    for more in ["0.48 0.64 0.6", "255 0 0"] {
        let row = |k: usize| format!("{} {} 1.5 {more}\n", k / 4, k % 4);
        let grid = (0..12).map(row).collect::<Vec<_>>().concat();
        assert_eq!(open(&grid).expect("reads").vertices.at(5), [1.0, 1.0, 1.5]);
    }
}
