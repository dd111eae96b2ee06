//! One page with the same three characters in each format, with the field names that the tools write.

use crate::labels::model::{LabelBox, LabelFormat, PageFile};

/// The page of the samples.
pub(super) const PAGE: PageFile<'static> = PageFile {
    name: "scans/page-03.jpg",
    bytes: 512_345,
    width: 1600,
    height: 1000,
};

/// Returns the boxes that all samples hold: two rectangles and a triangle, in pixels of the page.
pub(super) fn expected() -> Vec<LabelBox> {
    let boxes = [
        (
            "c01-r01",
            "\u{5929}",
            vec![
                [1400.0, 100.0],
                [1500.0, 100.0],
                [1500.0, 220.0],
                [1400.0, 220.0],
            ],
        ),
        (
            "c01-r02",
            "\u{20027}",
            vec![
                [1400.0, 240.0],
                [1496.0, 240.0],
                [1496.0, 350.0],
                [1400.0, 350.0],
            ],
        ),
        (
            "c02-r01",
            "\u{5730}",
            vec![[1250.0, 100.0], [1350.0, 150.0], [1280.0, 225.0]],
        ),
    ];
    let label = |(name, text, corners): (&str, &str, Vec<[f64; 2]>)| LabelBox {
        name: Some(name.to_owned()),
        text: Some(text.to_owned()),
        outline: corners
            .into_iter()
            .map(|[x, y]| [x - 0.5, y - 0.5])
            .collect(),
    };
    boxes.into_iter().map(label).collect()
}

/// Files with the format, whether they have names, and whether they have characters. `bboxes` has no polygons.
pub(super) const SAMPLES: [(LabelFormat, bool, bool, &str); 9] = [
    (LabelFormat::Via2, true, true, VIA_2),
    (LabelFormat::Via2, true, true, VIA_2_PROJECT),
    (LabelFormat::Via1, true, true, VIA_1),
    (LabelFormat::ViaCsv, true, true, VIA_CSV),
    (LabelFormat::Bboxes, true, true, BBOXES),
    (LabelFormat::Coco, true, true, COCO),
    (LabelFormat::Labelme, false, true, LABELME),
    (LabelFormat::Yolo, false, false, YOLO),
    (LabelFormat::PageXml, true, true, PAGE_XML),
];

pub(super) const VIA_2: &str = r#"{"page-03.jpg512345":{"filename":"page-03.jpg","size":512345,"regions":[
{"shape_attributes":{"name":"rect","x":1400,"y":100,"width":100,"height":120},"region_attributes":{"id":"c01-r01","label":"天"}},
{"shape_attributes":{"name":"rect","x":1400,"y":240,"width":96,"height":110},"region_attributes":{"id":"c01-r02","label":"𠀧"}},
{"shape_attributes":{"name":"polygon","all_points_x":[1250,1350,1280],"all_points_y":[100,150,225]},"region_attributes":{"id":"c02-r01","label":"地"}}
],"file_attributes":{"caption":"","public_domain":"no","image_url":""}},
"page-04.jpg498000":{"filename":"page-04.jpg","size":498000,"regions":[
{"shape_attributes":{"name":"rect","x":1,"y":2,"width":30,"height":40},"region_attributes":{}}],"file_attributes":{}}}"#;

pub(super) const VIA_2_PROJECT: &str = r#"{"_via_settings":{"ui":{"annotation_editor_height":25,"annotation_editor_fontsize":0.8,"leftsidebar_width":18,"image_grid":{"img_height":80,"rshape_fill":"none","rshape_fill_opacity":0.3,"rshape_stroke":"yellow","rshape_stroke_width":2,"show_region_shape":true,"show_image_policy":"all"},"image":{"region_label":"__via_region_id__","region_color":"__via_default_region_color__","region_label_font":"10px Sans","on_image_annotation_editor_placement":"NEAR_REGION"}},"core":{"buffer_size":18,"filepath":{},"default_filepath":""},"project":{"name":"via_project_3Nov2026_10h12m"}},
"_via_img_metadata":{"page-03.jpg512345":{"filename":"page-03.jpg","size":512345,"regions":[
{"shape_attributes":{"name":"rect","x":1400,"y":100,"width":100,"height":120},"region_attributes":{"Name":"c01-r01","Char":"天"}},
{"shape_attributes":{"name":"rect","x":1400,"y":240,"width":96,"height":110},"region_attributes":{"Name":"c01-r02","Char":"𠀧"}},
{"shape_attributes":{"name":"polygon","all_points_x":[1250,1350,1280],"all_points_y":[100,150,225]},"region_attributes":{"Name":"c02-r01","Char":"地"}}
],"file_attributes":{}}},
"_via_attributes":{"region":{"Name":{"type":"text","description":"","default_value":""},"Char":{"type":"text","description":"","default_value":""}},"file":{}},
"_via_data_format_version":"2.0.10","_via_image_id_list":["page-03.jpg512345"]}"#;

pub(super) const VIA_1: &str = r#"{"page-03.jpg512345":{"fileref":"","size":512345,"filename":"page-03.jpg","base64_img_data":"","file_attributes":{},"regions":{
"0":{"shape_attributes":{"name":"rect","x":1400,"y":100,"width":100,"height":120},"region_attributes":{"id":"c01-r01","text":"天"}},
"10":{"shape_attributes":{"name":"polygon","all_points_x":[1250,1350,1280,1250],"all_points_y":[100,150,225,100]},"region_attributes":{"id":"c02-r01","text":"地"}},
"2":{"shape_attributes":{"name":"rect","x":1400,"y":240,"width":96,"height":110},"region_attributes":{"id":"c01-r02","text":"𠀧"}}
}}}"#;

pub(super) const VIA_CSV: &str = r#"#filename,file_size,file_attributes,region_count,region_id,region_shape_attributes,region_attributes
page-02.jpg,77,"{}",0,0,"{}","{}"
page-03.jpg,512345,"{}",3,0,"{""name"":""rect"",""x"":1400,""y"":100,""width"":100,""height"":120}","{""id"":""c01-r01"",""char"":""天""}"
page-03.jpg,512345,"{}",3,1,"{""name"":""rect"",""x"":1400,""y"":240,""width"":96,""height"":110}","{""id"":""c01-r02"",""char"":""𠀧""}"
page-03.jpg,512345,"{}",3,2,"{""name"":""polygon"",""all_points_x"":[1250,1350,1280],""all_points_y"":[100,150,225]}","{""id"":""c02-r01"",""char"":""地""}"
"#;

pub(super) const BBOXES: &str = r#"{"bboxes": [
{"x_min": 1400, "y_min": 100, "x_max": 1500, "y_max": 220, "id": "c01-r01", "label": "天"},
{"x_min": 1400.0, "y_min": 240.0, "x_max": 1496.0, "y_max": 350.0, "id": "c01-r02", "label": "𠀧"},
{"x_min": 1250, "y_min": 100, "x_max": 1350, "y_max": 225, "id": "c02-r01", "label": "地"}]}"#;

pub(super) const COCO: &str = r#"{"info":{"year":2026},"licenses":[],
"images":[{"id":7,"width":1600,"height":1000,"file_name":"pages/page-03.jpg","license":0,"date_captured":""},{"id":8,"width":10,"height":10,"file_name":"page-04.jpg"}],
"categories":[{"id":1,"name":"天","supercategory":""},{"id":2,"name":"𠀧"},{"id":3,"name":"地"}],
"annotations":[
{"id":1,"image_id":7,"category_id":1,"bbox":[1400,100,100,120],"segmentation":[],"area":12000,"iscrowd":0,"attributes":{"name":"c01-r01","occluded":false}},
{"id":9,"image_id":8,"category_id":1,"bbox":[1,1,5,5],"segmentation":[],"area":25,"iscrowd":0},
{"id":2,"image_id":7,"category_id":2,"bbox":[1400,240,96,110],"segmentation":[[1400,240,1400,350,1496,350,1496,240]],"area":10560,"iscrowd":0,"attributes":{"name":"c01-r02"}},
{"id":3,"image_id":7,"category_id":3,"bbox":[1250,100,100,125],"segmentation":[[1250,100,1350,150,1280,225]],"area":5500,"iscrowd":0,"attributes":{"name":"c02-r01"}}]}"#;

pub(super) const LABELME: &str = r#"{"version":"5.4.1","flags":{},"shapes":[
{"label":"天","points":[[1500.0,220.0],[1400.0,100.0]],"group_id":null,"description":"","shape_type":"rectangle","flags":{},"mask":null},
{"label":"𠀧","points":[[1400.0,240.0],[1496.0,240.0],[1496.0,350.0],[1400.0,350.0]],"group_id":null,"shape_type":"rectangle","flags":{}},
{"label":"地","points":[[1250.0,100.0],[1350.0,150.0],[1280.0,225.0]],"group_id":null,"shape_type":"polygon","flags":{}}],
"imagePath":"..\\scans\\page-03.jpg","imageData":null,"imageHeight":1000,"imageWidth":1600}"#;

pub(super) const YOLO: &str = "\
0 0.90625 0.16 0.0625 0.12
0 0.905 0.295 0.06 0.11
0 0.78125 0.1 0.84375 0.15 0.8 0.225
";

pub(super) const PAGE_XML: &str = r#"<?xml version="1.0" encoding="UTF-8" standalone="yes"?>
<PcGts xmlns="http://schema.primaresearch.org/PAGE/gts/pagecontent/2019-07-15" pcGtsId="p3">
  <Metadata><Creator>x &amp; y</Creator><Created>2026-01-01T00:00:00</Created></Metadata>
  <Page imageFilename="page-03.jpg" imageWidth="1600" imageHeight="1000">
    <ReadingOrder><OrderedGroup id="ro"><RegionRefIndexed index="0" regionRef="r1"/></OrderedGroup></ReadingOrder>
    <TextRegion id="r1" type="paragraph"><Coords points="1250,100 1500,100 1500,350 1250,350"/>
      <TextLine id="l1"><Coords points="1400,100 1500,100 1500,350 1400,350"/><Baseline points="1450,100 1450,350"/>
        <Word id="w1"><Coords points="1400,100 1500,100 1500,350 1400,350"/>
          <Glyph id="c01-r01"><Coords points="1400,100 1500,100 1500,220 1400,220"/>
            <TextEquiv index="1" conf="0.2"><Unicode>大</Unicode></TextEquiv><TextEquiv index="0" conf="0.7"><Unicode>天</Unicode></TextEquiv></Glyph>
          <Glyph id="c01-r02"><Coords points="1400,240 1496,240 1496,350 1400,350"/><TextEquiv><Unicode>&#131111;</Unicode></TextEquiv></Glyph>
          <TextEquiv><Unicode>天𠀧</Unicode></TextEquiv></Word>
        <TextEquiv><Unicode>天𠀧</Unicode></TextEquiv></TextLine>
      <TextLine id="l2"><Coords points="1250,100 1350,100 1350,225 1250,225"/>
        <Word id="w2"><Coords points="1250,100 1350,100 1350,225 1250,225"/>
          <Glyph id="c02-r01"><Coords><Point x="1250" y="100"/><Point x="1350" y="150"/><Point x="1280" y="225"/></Coords>
            <TextEquiv><PlainText/><Unicode><![CDATA[地]]></Unicode></TextEquiv></Glyph></Word></TextLine>
    </TextRegion>
  </Page>
</PcGts>"#;
