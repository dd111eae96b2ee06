// Texts of the page on which boxes are changed, in English and Vietnamese.

import { blockText } from "./block-messages.js";
import { withValues } from "./scan-messages.js";

const BOX_MESSAGES = {
  boxes_view: { en: "Page with its boxes", vi: "Trang in với các khung chữ" },
  page: { en: "Page", vi: "Trang in" },
  choose: { en: "Choose a box", vi: "Chọn khung" },
  previous: { en: "Previous box", vi: "Khung trước" },
  next: { en: "Next box", vi: "Khung sau" },
  change: { en: "Change boxes", vi: "Sửa khung" },
  steps: { en: "Steps", vi: "Các bước" },
  view: { en: "View", vi: "Khung nhìn" },
  add: { en: "Add", vi: "Thêm" },
  remove: { en: "Delete", vi: "Xóa" },
  undo: { en: "Undo", vi: "Hoàn tác" },
  redo: { en: "Redo", vi: "Làm lại" },
  step: { en: "10 px steps", vi: "Bước 10 px" },
  name: { en: "Name", vi: "Tên" },
  text: { en: "Character", vi: "Chữ" },
  save: { en: "Save", vi: "Lưu" },
  use_earlier: { en: "Use the earlier labels", vi: "Dùng lại nhãn trước" },
  cancel: { en: "Cancel", vi: "Thôi" },
  ask_earlier: {
    en: "Use the labels that these have replaced? The present ones stay as a file, and unsaved changes are lost.",
    vi: "Dùng lại nhãn mà các khung này đã thay? Nhãn hiện tại vẫn còn trong một tệp, các thay đổi chưa lưu sẽ mất.",
  },
  counts: { en: "boxes: {n} · changed: {changed}", vi: "số khung: {n} · đã đổi: {changed}" },
  counts_unread: { en: "boxes of the labels: unknown · new: {n}", vi: "số khung của nhãn: không rõ · khung mới: {n}" },
  unread: {
    en: "The labels cannot be read, so their boxes are not shown. Put the file back and reload the page. Boxes that are saved here take its place.",
    vi: "Không đọc được nhãn nên không hiện khung của chúng. Hãy đưa tệp về chỗ cũ rồi tải lại trang. Khung được lưu ở đây sẽ thay tệp đó.",
  },
  how: {
    en: "Choose a box to move, resize, name or delete it; drag its corners to resize it.",
    vi: "Chọn một khung để di chuyển, đổi cỡ, đặt tên hoặc xóa; kéo các góc để đổi cỡ.",
  },
  no_boxes: { en: "This page has no boxes yet: add them.", vi: "Trang này chưa có khung nào: hãy thêm khung." },
  found: {
    en: "These boxes were found. After saving, they are labels, and no boxes are found any more.",
    vi: "Các khung này được tự tìm. Khi lưu, chúng trở thành nhãn và không còn tự tìm khung nữa.",
  },
  selected: { en: "Box {name}: {width} x {height} px", vi: "Khung {name}: {width} x {height} px" },
  unnamed: { en: "without a name", vi: "chưa có tên" },
  draw: {
    en: "Drag a box on the page, or tap where it should be. Escape: none.",
    vi: "Hãy kéo một khung trên trang in, hoặc chạm vào chỗ cần đặt. Escape: thôi.",
  },
  nothing_changed: { en: "Nothing has changed, so nothing was saved.", vi: "Không có gì thay đổi nên không lưu gì." },
  changed_meanwhile: {
    en: "Saved, but boxes were changed meanwhile. Reload the page, and change them again.",
    vi: "Đã lưu, nhưng có khung được sửa trong lúc lưu. Hãy tải lại trang rồi sửa lại.",
  },
  saving: { en: "Saving …", vi: "Đang lưu …" },
  saved: { en: "Saved. Cut the block again with: {command}", vi: "Đã lưu. Cắt lại ván bằng lệnh: {command}" },
  saved_run: { en: "Saved. The next run cuts the block again.", vi: "Đã lưu. Lần chạy sau sẽ cắt lại ván." },
  to_run: { en: "Cut the block again on the page Run", vi: "Cắt lại ván ở trang Căn chỉnh" },
  keys: {
    en: "Page Up, Page Down: previous, next box · arrow keys: move the box, or the page without one · Shift: resize · Alt: 10 px · A, Enter: add · Delete: delete · Escape: no box · Ctrl + Z, Ctrl + Y: undo, redo · wheel, + −: zoom · 0: whole page",
    vi: "Page Up, Page Down: khung trước, sau · phím mũi tên: di chuyển khung, hoặc trang nếu chưa chọn · Shift: đổi cỡ · Alt: 10 px · A, Enter: thêm · Delete: xóa · Escape: bỏ chọn · Ctrl + Z, Ctrl + Y: hoàn tác, làm lại · con lăn, + −: phóng · 0: cả trang",
  },
  no_data: { en: "The boxes cannot be displayed: {why}", vi: "Không hiển thị được các khung: {why}" },
};

/** Returns a text of this page, or else of the page of the block, with `{name}` replaced by the values. */
export function boxText(language, key, values = {}) {
  return key in BOX_MESSAGES ? withValues(BOX_MESSAGES[key][language], values) : blockText(language, key, values);
}
