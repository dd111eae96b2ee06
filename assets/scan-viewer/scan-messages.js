// Texts of the 3D view in English and Vietnamese.

const SCAN_MESSAGES = {
  view: { en: "3D view of the scan", vi: "Bản quét 3D" },
  controls: { en: "Controls of the 3D view", vi: "Điều khiển khung xem 3D" },
  colour: { en: "Wood to ink", vi: "Từ gỗ đến mực" },
  light_direction: { en: "Light from (degrees)", vi: "Hướng chiếu sáng (độ)" },
  light_height: { en: "Light above the surface (degrees)", vi: "Góc chiếu so với mặt ván (độ)" },
  shading: { en: "Shading", vi: "Độ tương phản sáng tối" },
  exaggeration: { en: "Relief height", vi: "Phóng đại độ cao nét" },
  threshold: { en: "Above the threshold", vi: "Phần cao hơn ngưỡng" },
  threshold_height: { en: "Threshold", vi: "Ngưỡng" },
  strokes: { en: "Strokes of the result", vi: "Nét của kết quả" },
  ink_outline: { en: "Outline of the ink", vi: "Đường viền nét mực" },
  plane: { en: "Fitted plane", vi: "Mặt phẳng khớp" },
  as_printed: { en: "As printed (mirrored)", vi: "Như bản in (lật gương)" },
  reset: { en: "Reset the view", vi: "Đặt lại góc nhìn" },
  close: { en: "Close", vi: "Đóng" },
  keys: { en: "Keys", vi: "Phím tắt" },
  key_list: {
    en: "arrow keys: turn · Shift + arrow keys: move · + −: closer, farther · 0: reset · W: wood or ink · S: strokes · O: outline · T: threshold · G: plane · [ ]: relief height · M: as printed · Escape: close",
    vi: "phím mũi tên: xoay · Shift + mũi tên: di chuyển · + −: gần, xa · 0: đặt lại · W: gỗ hoặc mực · S: nét · O: đường viền · T: ngưỡng · G: mặt phẳng · [ ]: độ cao nét · M: như bản in · Escape: đóng",
  },
  triangles: { en: "{n} triangles", vi: "{n} tam giác" },
  points: { en: "{n} points", vi: "{n} điểm" },
  simplified: { en: "simplified from {n}", vi: "giản lược từ {n}" },
  grid_step: { en: "grid {step}", vi: "ô lưới {step}" },
  picked: { en: "height {height}, print pixel {x}, {y}", vi: "độ cao {height}, điểm ảnh {x}, {y}" },
  picked_beside: { en: "height {height}, beside the print", vi: "độ cao {height}, ngoài bản in" },
  alone: {
    en: "This pair has no result yet: the scan is shown alone, without a plane and a print.",
    vi: "Cặp này chưa có kết quả: chỉ hiện bản quét, chưa có mặt phẳng và bản in.",
  },
  alone_key_list: {
    en: "arrow keys: turn · Shift + arrow keys: move · + −: closer, farther · 0: reset",
    vi: "phím mũi tên: xoay · Shift + mũi tên: di chuyển · + −: gần, xa · 0: đặt lại",
  },
  no_webgl: {
    en: "This browser cannot draw in 3D (WebGL 2 is not available).",
    vi: "Trình duyệt này không vẽ được 3D (không có WebGL 2).",
  },
  no_data: { en: "The scan cannot be displayed: {why}", vi: "Không hiển thị được bản quét: {why}" },
};

/** Returns the language that the server gives, or else the first supported one of the browser, or English. */
export function preferredLanguage() {
  const given = document.querySelector("meta[name=page-language]")?.content;
  return given ?? navigator.languages?.find((language) => /^(vi|en)\b/.test(language))?.slice(0, 2) ?? "en";
}

/**
 * Formats a number in the language of the page, with a thin space between groups of three digits and without a sign on
 * zero. `digits` is the number of decimals; without it, the number has as many as it needs.
 */
export function localNumber(value, digits) {
  const format = { minimumFractionDigits: digits ?? 0, maximumFractionDigits: digits ?? 10, useGrouping: false };
  const text = value.toLocaleString(document.documentElement.lang || "en", format);
  const [whole, ...decimals] = text.replace(/^-(0([.,]0*)?)$/, "$1").replace(/^-/, "−").split(/(?=[.,])/);
  return [whole.replace(/\B(?=(\d{3})+$)/g, "\u202f"), ...decimals].join("");
}

/** Returns a text with `{name}` replaced by the values, of which numbers are written as in the language of the page. */
export function withValues(text, values) {
  const shown = (value) => (typeof value === "number" ? localNumber(value) : value);
  return text.replace(/\{(\w+)\}/g, (placeholder, name) => shown(values[name]) ?? placeholder);
}

/** Returns a text with `{name}` replaced by the values. */
export function scanText(language, key, values = {}) {
  return withValues(SCAN_MESSAGES[key][language], values);
}
