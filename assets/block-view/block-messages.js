// Texts of the page of a block in English and Vietnamese.

import { withValues } from "./scan-messages.js";

const BLOCK_MESSAGES = {
  page_view: { en: "Page of the block", vi: "Trang in của ván" },
  layers: { en: "Layer", vi: "Lớp" },
  page: { en: "Page", vi: "Trang in" },
  relief: { en: "Relief", vi: "Mặt khắc" },
  overlay: { en: "Overlay", vi: "Chồng hình" },
  boxes: { en: "Boxes", vi: "Khung chữ" },
  drawing: { en: "Drawing the {layer} …", vi: "Đang vẽ {layer} …" },
  no_layer: { en: "This layer could not be drawn. Choose it again.", vi: "Không vẽ được lớp này. Hãy chọn lại." },
  no_layer_why: { en: "This layer could not be drawn: {why}", vi: "Không vẽ được lớp này: {why}" },
  closer: { en: "Closer", vi: "Phóng to" },
  farther: { en: "Farther", vi: "Thu nhỏ" },
  whole: { en: "Whole page", vi: "Cả trang" },
  characters: { en: "{n} characters · {agreement} % of the places agree", vi: "{n} chữ · {agreement} % vị trí khớp" },
  done: { en: "done", vi: "xong" },
  low_confidence: { en: "low confidence", vi: "độ tin cậy thấp" },
  failed: { en: "failed, or not cut", vi: "lỗi hoặc không được cắt" },
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
  correct: { en: "Correct the alignment", vi: "Sửa căn chỉnh" },
  edit_boxes: { en: "Edit boxes", vi: "Sửa khung chữ" },
  back_to_page: { en: "Back to the page", vi: "Về trang in" },
  side: { en: "Side of the block", vi: "Mặt của ván" },
  front: { en: "Front", vi: "Mặt trước" },
  back: { en: "Back", vi: "Mặt sau" },
  turn_relief: { en: "Turn the relief", vi: "Xoay mặt khắc" },
  try_points: { en: "Try", vi: "Thử" },
  save_points: { en: "Save", vi: "Lưu" },
  clear_points: { en: "Clear", vi: "Xóa hết" },
  remove_saved: { en: "Remove the saved points", vi: "Bỏ các điểm đã lưu" },
  remove_point: { en: "Remove point {n}", vi: "Bỏ điểm {n}" },
  correct_how: {
    en: "Choose at least three places: each once on the relief and once on the page, best near the corners of the text.",
    vi: "Chọn ít nhất ba chỗ: mỗi chỗ một lần trên mặt khắc và một lần trên trang in, tốt nhất gần các góc của phần chữ.",
  },
  correct_saved_points: { en: "These points are saved. Try other ones, or remove them.", vi: "Đây là các điểm đã lưu. Hãy thử điểm khác hoặc bỏ đi." },
  correct_other_files: {
    en: "The saved points belong to another scan or page, and are not used.",
    vi: "Các điểm đã lưu thuộc về bản quét hoặc trang in khác nên không được dùng.",
  },
  choose_on_page: { en: "Choose the same place on the page (point {n}).", vi: "Chọn chỗ đó trên trang in (điểm {n})." },
  choose_on_relief: { en: "Choose the same place on the relief (point {n}).", vi: "Chọn chỗ đó trên mặt khắc (điểm {n})." },
  choose_more: { en: "Points still needed: {n}.", vi: "Còn thiếu {n} điểm." },
  ready_to_try: { en: "Try the points, or choose more.", vi: "Hãy thử các điểm, hoặc chọn thêm." },
  points_chosen: { en: "Points chosen: {n}.", vi: "Đã chọn {n} điểm." },
  trying: { en: "Aligning …", vi: "Đang căn chỉnh …" },
  tried: {
    en: "{agreement} % of the places agree. Where ink and stroke agree, the overlay is dark; if it looks right, save the points.",
    vi: "{agreement} % vị trí khớp. Chỗ mực và nét khớp nhau có màu tối; nếu đúng thì lưu các điểm.",
  },
  saved: { en: "Saved. Align and cut the block again with: {command}", vi: "Đã lưu. Căn chỉnh và cắt lại ván bằng lệnh: {command}" },
  removed: { en: "Removed. Align and cut the block again with: {command}", vi: "Đã bỏ. Căn chỉnh và cắt lại ván bằng lệnh: {command}" },
  saved_run: { en: "Saved. The next run aligns and cuts the block again.", vi: "Đã lưu. Lần chạy sau sẽ căn chỉnh và cắt lại ván." },
  removed_run: { en: "Removed. The next run aligns and cuts the block again.", vi: "Đã bỏ. Lần chạy sau sẽ căn chỉnh và cắt lại ván." },
  correct_keys: {
    en: "click, Enter: choose a place · click on a number: remove the point · Backspace: remove the last one · T: turn the relief · wheel, + −: zoom · 0: whole · drag, arrow keys: move",
    vi: "nhấp, Enter: chọn chỗ · nhấp vào số: bỏ điểm · Backspace: bỏ điểm cuối · T: xoay mặt khắc · con lăn, + −: phóng · 0: toàn bộ · kéo, phím mũi tên: di chuyển",
  },
  no_answer: { en: "The program does not answer. If it was ended, start it again.", vi: "Chương trình không trả lời. Nếu chương trình đã dừng, hãy mở lại." },
  no_data: { en: "The block cannot be displayed: {why}", vi: "Không hiển thị được ván: {why}" },
};

/** Returns a text with `{name}` replaced by the values. */
export function blockText(language, key, values = {}) {
  return withValues(BLOCK_MESSAGES[key][language], values);
}
