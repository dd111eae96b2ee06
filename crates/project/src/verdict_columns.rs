//! The columns of a list of verdicts, which are also the fields of JSON Lines.

use mocban_lists::columns::KnownColumns;

/// The columns, and their other names in English and Vietnamese. Every list must have the first three.
pub(crate) const COLUMNS: KnownColumns = KnownColumns {
    names: &[
        "pair",
        "verdict",
        "reviewer",
        "metric",
        "reason",
        "note",
        "at",
        "angle_read_deg",
    ],
    other_names: &[
        ("ma_so", "pair"),
        ("so_hieu", "pair"),
        ("ma_cap", "pair"),
        ("cap", "pair"),
        ("ma", "pair"),
        // Last, because it may be the id of the verdict.
        ("id", "pair"),
        ("danh_gia", "verdict"),
        ("ket_qua", "verdict"),
        ("ket_luan", "verdict"),
        ("reader", "reviewer"),
        ("nguoi_danh_gia", "reviewer"),
        ("nguoi_cham", "reviewer"),
        ("thuoc_do", "metric"),
        ("ly_do", "reason"),
        ("li_do", "reason"),
        ("ghi_chu", "note"),
        ("thoi_gian", "at"),
        ("ngay", "at"),
        ("goc_lech", "angle_read_deg"),
        ("goc_xoay", "angle_read_deg"),
        ("goc", "angle_read_deg"),
    ],
};

/// Number of columns that every list has.
pub(crate) const REQUIRED: usize = 3;
