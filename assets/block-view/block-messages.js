// Texts of the page of a block in English and Vietnamese.

const BLOCK_MESSAGES = {
  page_view: { en: "Page of the block", vi: "Trang in của ván" },
  layers: { en: "Layer", vi: "Lớp" },
  page: { en: "Page", vi: "Trang" },
  relief: { en: "Relief", vi: "Mặt khắc" },
  overlay: { en: "Overlay", vi: "Chồng lớp" },
  boxes: { en: "Boxes", vi: "Khung chữ" },
  closer: { en: "Closer", vi: "Phóng to" },
  farther: { en: "Farther", vi: "Thu nhỏ" },
  whole: { en: "Whole page", vi: "Cả trang" },
  characters: { en: "{n} characters · {agreement} % of the places agree", vi: "{n} chữ · {agreement} % vị trí khớp" },
  done: { en: "done", vi: "xong" },
  low_confidence: { en: "low confidence", vi: "độ tin cậy thấp" },
  failed: { en: "failed, or not cut", vi: "thất bại hoặc không cắt được" },
  waiting: { en: "not run", vi: "chưa chạy" },
  both: { en: "ink and stroke", vi: "mực và nét" },
  stroke_only: { en: "stroke without ink", vi: "nét không có mực" },
  ink_only: { en: "ink without stroke", vi: "mực không có nét" },
  position: { en: "position {value}", vi: "vị trí {value}" },
  confidence: { en: "confidence {value}", vi: "độ tin cậy {value}" },
  iou: { en: "IoU {value}", vi: "IoU {value}" },
  no_result: { en: "There is no result to show in 3D.", vi: "Chưa có kết quả để xem 3D." },
  loading: { en: "Loading …", vi: "Đang tải …" },
  close: { en: "Close", vi: "Đóng" },
  keys: {
    en: "wheel, + −: zoom · 0: whole page · drag, arrow keys: move · P R O: layer · B: boxes · click, Enter: open in 3D",
    vi: "con lăn, + −: phóng · 0: cả trang · kéo, phím mũi tên: di chuyển · P R O: lớp · B: khung · nhấp, Enter: xem 3D",
  },
  no_data: { en: "The block cannot be displayed: {why}", vi: "Không hiển thị được ván: {why}" },
};

/** Returns a text with `{name}` replaced by the values. */
export function blockText(language, key, values = {}) {
  return BLOCK_MESSAGES[key][language].replace(/\{(\w+)\}/g, (placeholder, name) => values[name] ?? placeholder);
}
