//! Boxes of COCO whose `image_id` is written differently from the id of their image.

use serde_json::{Value, json};

use super::samples::PAGE;
use crate::labels::read;

/// Returns a file with two images, whose annotations, one for each id, have these ids.
fn file(images: [Value; 2], ids: &[Value]) -> String {
    let image = |(k, id): (usize, Value)| {
        let name = ["page-03.jpg", "other.jpg"][k];
        json!({"id": id, "file_name": name, "width": PAGE.width, "height": PAGE.height})
    };
    let images: Vec<Value> = images.into_iter().enumerate().map(image).collect();
    let annotation =
        |(k, id): (usize, &Value)| json!({"image_id": id, "bbox": [10 + 60 * k, 10, 50, 50]});
    let annotations: Vec<Value> = ids.iter().enumerate().map(annotation).collect();
    json!({"images": images, "annotations": annotations}).to_string()
}

#[test]
fn an_id_in_another_form_is_that_of_its_image() {
    for id in [
        json!("001"),
        json!("1.0"),
        json!(1.0),
        json!("1"),
        json!("Page-03.JPG"),
        json!("scans/page-03.jpg"),
        json!("page-03"),
    ] {
        let text = file([json!(1), json!(2)], &[id.clone(), json!(1), json!(2)]);
        let labels = read(text.as_bytes(), "c.json", &PAGE).expect("labels");
        assert_eq!(labels.boxes.len(), 2, "{id}");
        assert_eq!(labels.warnings, [""; 0], "{id}");
    }
}

#[test]
fn ids_of_no_image_are_the_reason_why_a_page_has_no_boxes() {
    for (images, id) in [
        ([json!(1), json!(2)], json!(17)),
        ([json!("01"), json!("001")], json!(1)),
        ([json!(1), json!(2)], json!("page-04")),
    ] {
        let text = file(images.clone(), &[id.clone(), id.clone()]);
        let refused = read(text.as_bytes(), "c.json", &PAGE).expect_err("no boxes");
        let expected = "c.json: the file has no boxes of this page, and the image_id of others is that of no image (boxes: 2); \
            write the id of their image there";
        assert_eq!(refused.to_string(), expected, "{images:?} {id}");
    }
    let text = file([json!(1), json!(2)], &[json!(1), json!(17)]);
    let labels = read(text.as_bytes(), "c.json", &PAGE).expect("labels");
    let warning = "c.json: 1 box left out, whose image_id is that of no image";
    assert_eq!(labels.warnings, [warning]);
}
