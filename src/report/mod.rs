//! Catalog to table: plain data, then text, CSV, JSON, Markdown, LaTeX.
