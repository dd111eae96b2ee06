//! The columns of a list of whole blocks.

use crate::columns::KnownColumns;

/// The columns of a list of blocks, and their Vietnamese names. The first three are required.
pub(super) const COLUMNS: KnownColumns = KnownColumns {
    names: &["block", "mesh", "page", "labels", "unit", "side"],
    other_names: &[
        ("so_hieu_van", "block"),
        ("ma_van", "block"),
        ("van", "block"),
        ("van_khac", "block"),
        ("khoi", "block"),
        ("moc_ban", "block"),
        ("van_so", "block"),
        ("ma_hien_vat", "block"),
        ("ban_quet", "mesh"),
        ("ban_quet_3d", "mesh"),
        ("tep_quet", "mesh"),
        ("luoi", "mesh"),
        ("tep_ban_quet", "mesh"),
        ("anh_trang", "page"),
        ("anh_trang_in", "page"),
        ("tep_trang_in", "page"),
        ("tep_trang", "page"),
        ("trang_in", "page"),
        ("trang", "page"),
        ("nhan", "labels"),
        ("tep_nhan", "labels"),
        ("don_vi", "unit"),
        ("don_vi_do", "unit"),
        ("don_vi_cua_ban_quet", "unit"),
        ("mat", "side"),
    ],
};

/// Number of columns that every list of blocks needs.
pub(super) const REQUIRED: usize = 3;

/// The other columns with a meaning.
pub(super) const OPTIONAL: [&str; 3] = ["labels", "unit", "side"];
