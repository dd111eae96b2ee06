//! The import table holds, and every room is in the code map.
