//! The exceptions of `mocban._errors`.

use std::path::Path;

use pyo3::prelude::*;

use mocban_project::{ProjectError, Refusal};

/// Makes an exception of a class of `mocban._errors`.
pub(crate) fn raise(
    py: Python<'_>,
    class: &str,
    code: &str,
    text: &str,
    path: Option<&Path>,
) -> PyErr {
    let made = (|| {
        let class = py.import("mocban._errors")?.getattr(class)?;
        class.call1((text, code, path))
    })();
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Makes the exception of an argument that cannot be used.
pub(crate) fn wrong_argument(py: Python<'_>, text: &str) -> PyErr {
    raise(py, "InputError", "usage", text, None)
}

/// Makes the exception of a file that cannot be opened or read.
pub(crate) fn unreadable(py: Python<'_>, class: &str, error: &Refusal, path: &Path) -> PyErr {
    let text = error.to_string();
    match path.try_exists() {
        Ok(false) => raise(py, "InputNotFound", "not_found", &text, Some(path)),
        _ => raise(py, class, "unreadable", &text, Some(path)),
    }
}

/// Makes the exception of an error of the project library. `dir` is the folder that it is about.
pub(crate) fn project_failure(py: Python<'_>, error: &ProjectError, dir: &Path) -> PyErr {
    let code = error.code();
    raise(
        py,
        class_of(code.name()),
        code.name(),
        &error.text(dir),
        Some(dir),
    )
}

/// Returns the class of a code of the project library.
fn class_of(code: &str) -> &'static str {
    match code {
        "settings" => "SettingsError",
        "no_project" => "NotAProject",
        "other_version" | "not_a_catalog" => "ProjectVersionError",
        "project_in_use" | "output_in_use" | "locked" => "ProjectBusy",
        "not_writable" | "not_permitted" => "ReadOnlyProject",
        _ => "ProjectError",
    }
}
