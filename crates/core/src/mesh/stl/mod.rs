//! Readers of binary and ASCII STL, in which each triangle has three vertices of its own.

mod ascii;
mod binary;

pub(super) use ascii::read_ascii;
pub(super) use binary::{
    FACET, HEADER, binary_count, corners, read_binary, read_facets, truncated, whole_binary_count,
};

#[cfg(test)]
mod tests {
    use crate::mesh::{Mesh, MeshError, MeshLimits, read};

    fn binary(header: &[u8], corners: &[[f32; 3]]) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend((corners.len() as u32 / 3).to_le_bytes());
        for facet in corners.chunks_exact(3) {
            bytes.extend([0xff; 12]);
            for value in facet.as_flattened() {
                bytes.extend(value.to_le_bytes());
            }
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn open(bytes: &[u8]) -> Result<Mesh, MeshError> {
        read(bytes, "scan.stl", &MeshLimits::SUGGESTED)
    }

    const CORNERS: [[f32; 3]; 6] = [
        [0., 0., 0.],
        [1., 0., 0.],
        [0., 1., 0.],
        [0., 1., 0.],
        [1., 0., 0.],
        [1., 1., 0.25],
    ];

    #[test]
    fn binary_is_detected_even_when_its_header_begins_with_solid() {
        for header in [b"solid made by a scanner".as_slice(), b"", b"COLOR=...."] {
            let mesh = open(&binary(header, &CORNERS)).expect("reads");
            assert_eq!(mesh.vertices.len(), 6);
            assert_eq!(mesh.vertices.at(5), [1.0, 1.0, 0.25]);
            assert_eq!(*mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
        }
    }

    #[test]
    fn bytes_after_the_last_triangle_are_ignored() {
        let mut bytes = binary(b"", &CORNERS);
        bytes.extend(b"trailer");
        assert_eq!(open(&bytes).expect("reads").triangles.len(), 2);
    }

    #[test]
    fn triangles_that_the_header_does_not_count_are_refused() {
        for (count, header) in [(1, b"solid a".as_slice()), (0, b"\0")] {
            let mut bytes = binary(header, &CORNERS);
            bytes[80] = count;
            let error = open(&bytes).expect_err("a wrong count");
            let wanted = format!(
                "the binary STL holds 2 triangles, but its header says {count}; save it again with the right count"
            );
            assert_eq!(error.to_string(), wanted);
        }
    }

    /// Returns a binary STL whose facets have no simple numbers, with bytes after each.
    fn odd_facets(count: u32, after_each: &[u8]) -> Vec<u8> {
        let mut bytes = vec![b' '; 80];
        bytes.extend(count.to_le_bytes());
        for facet in 0..count {
            for value in 0..12 {
                let value = (facet * 12 + value) as f32;
                bytes.extend((value * 0.37 + 1.01).sin().to_le_bytes());
            }
            bytes.extend([0; 2]);
            bytes.extend(after_each);
        }
        bytes
    }

    #[test]
    fn text_after_the_last_triangle_is_ignored_and_other_bytes_are_named() {
        let usual = open(&odd_facets(20, &[])).expect("reads");
        let text = b"made by a scanner\n".repeat(12);
        for len in [1, 7, 20, 49, 50, 100, 200, 216] {
            let bytes = [&odd_facets(20, &[])[..], &text[..len]].concat();
            assert_eq!(open(&bytes).as_ref(), Ok(&usual), "{len}");
            let bytes = [&odd_facets(20, &[])[..], &vec![0xff; len]].concat();
            match open(&bytes) {
                Ok(mesh) => assert!(len < 50 && mesh == usual, "{len}"),
                Err(error) => assert_eq!(
                    error.to_string(),
                    format!(
                        "the binary STL has {len} bytes after the rows that its header counts; save it again with the right counts"
                    )
                ),
            }
        }
        let mut more = odd_facets(24, &[]);
        more[80] = 20;
        assert_eq!(
            open(&more).expect_err("uncounted").to_string(),
            "the binary STL holds 24 triangles, but its header says 20; save it again with the right count"
        );
    }

    #[test]
    fn text_of_any_script_and_zeros_after_the_last_triangle_are_ignored() {
        let usual = open(&odd_facets(20, &[])).expect("reads");
        for tail in [
            "mộc bản, 經版\r\n".repeat(20).as_bytes(),
            &"quét".repeat(10).as_bytes()[..50],
            &b"made by x\0\0\0".repeat(25),
            &[0; 1000],
            &[0; 70],
        ] {
            let bytes = [&odd_facets(20, &[])[..], tail].concat();
            assert_eq!(open(&bytes).as_ref(), Ok(&usual), "{tail:?}");
        }
        // Facets of small whole numbers are no text, although their bytes are letters and zeros.
        let corners = [[2.0, 3.0, 8.0], [3.0, 2.0, 8.0], [2.0, 2.0, 2.0]].repeat(24);
        let mut more = binary(b"", &corners);
        more[80] = 20;
        assert!(matches!(open(&more), Err(MeshError::Uncounted { .. })));
    }

    #[test]
    fn long_triangles_that_are_cut_off_are_truncated() {
        let bytes = odd_facets(20, &[7; 4]);
        let said = |bytes: &[u8]| open(bytes).expect_err("refused").to_string();
        assert_eq!(
            said(&bytes),
            "the binary STL has 54 bytes a triangle instead of 50; save it again without attributes, or as PLY"
        );
        assert_eq!(
            said(&bytes[..bytes.len() - 1]),
            "the binary STL is truncated: it holds 19 of 20 triangles"
        );
        for len in [1, 15, 90, 200] {
            let with_text = [&bytes[..], &vec![b'a'; len]].concat();
            assert_eq!(said(&with_text), said(&bytes), "{len}");
        }
    }

    #[test]
    fn comments_may_precede_an_ascii_solid() {
        let usual = open(ASCII.as_bytes()).expect("reads");
        for comment in ["# made by a scanner\n", "// a\r\n% b\r\n", "\n#\n\n"] {
            let text = format!("{comment}{ASCII}");
            assert_eq!(open(text.as_bytes()).as_ref(), Ok(&usual), "{comment:?}");
        }
    }

    /// A file may contain several solids, so the parser reads on after the last solid and finds an unknown word.
    #[test]
    fn ascii_text_after_the_last_solid_is_refused_by_its_line() {
        let error = open(format!("{ASCII}made by a scanner\n").as_bytes()).expect_err("text");
        let text = error.to_string();
        assert!(
            text.starts_with("line 11: ") && text.contains("made"),
            "{text}"
        );
    }

    #[test]
    fn truncated_binary_reports_both_counts() {
        for header in [b"solid a".as_slice(), b"\0", b"text header"] {
            let bytes = binary(header, &CORNERS);
            let error = open(&bytes[..bytes.len() - 1]).expect_err("truncated");
            assert_eq!(
                error.to_string(),
                "the binary STL is truncated: it holds 1 of 2 triangles"
            );
        }
        let error = open(&[&b"\0x"[..], &[0; 48]].concat()).expect_err("truncated");
        assert_eq!(
            error.to_string(),
            "the binary STL is truncated: it holds 50 of 84 bytes of its header"
        );
    }

    #[test]
    fn excessive_count_is_an_error_not_an_allocation() {
        let mut bytes = binary(b"", &CORNERS);
        bytes[80..84].fill(0xff);
        let error = open(&bytes).expect_err("lies");
        assert_eq!(
            error.to_string(),
            "the binary STL is truncated: it holds 2 of 4294967295 triangles"
        );
    }

    #[test]
    fn no_facets_are_refused() {
        assert_eq!(open(&binary(b"", &[])), Err(MeshError::NoFaces));
        assert_eq!(
            open(b"solid empty\nendsolid empty\n"),
            Err(MeshError::NoFaces)
        );
    }

    const ASCII: &str = "solid a b\n FACET NORMAL nan nan nan\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n \
        vertex 1 1 1e-1\n vertex 0 1 0\n endloop\n endfacet\nendsolid a b\n";

    #[test]
    fn ascii_loops_of_four_become_two_triangles() {
        let mesh = open(ASCII.as_bytes()).expect("reads");
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(mesh.vertices.at(2), [1.0, 1.0, 0.1]);
        let two = open(ASCII.repeat(2).as_bytes()).expect("reads");
        assert_eq!(two.triangles.len(), 4);
    }

    #[test]
    fn truncated_ascii_reports_where_it_ends() {
        let cut = |word: &str| &ASCII[..ASCII.find(word).expect("is there")];
        assert_eq!(
            open(cut("endsolid").as_bytes())
                .expect_err("cut")
                .to_string(),
            "the ascii STL is truncated: it ends after 1 facets without endsolid"
        );
        assert_eq!(
            open(cut("endloop").as_bytes())
                .expect_err("cut")
                .to_string(),
            "the ascii STL is truncated: it ends after 0 facets without endfacet"
        );
        assert_eq!(
            open(cut(" 1e-1").as_bytes()).expect_err("cut").to_string(),
            "line 6: 2 of 3 coordinates; it is the last line, so the file seems to be cut off"
        );
    }
}
