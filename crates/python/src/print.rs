//! The image of a print, from an array or a file.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::compute::compute;
use crate::failure::{raise, unreadable};
use crate::settings::NativeSettings;
use mocban_align::stages::{Print, normalize};
use mocban_core::raster::{PrintImage, SampleSlice};
use mocban_project::align;

/// The image of a print and its file.
#[pyclass(frozen, module = "mocban._native")]
pub(crate) struct NativePrint {
    pub(crate) print: Arc<Print>,
    #[pyo3(get)]
    pub(crate) path: Option<PathBuf>,
}

impl NativePrint {
    pub(crate) fn image(&self) -> &PrintImage {
        self.print.image()
    }
}

#[pymethods]
impl NativePrint {
    /// Copies the samples of an image.
    #[new]
    fn from_samples(
        py: Python<'_>,
        eight: Option<PyReadonlyArray1<'_, u8>>,
        sixteen: Option<PyReadonlyArray1<'_, u16>>,
        width: usize,
        height: usize,
        channels: usize,
    ) -> PyResult<Self> {
        let samples = match (&eight, &sixteen) {
            (Some(eight), _) => SampleSlice::Eight(eight.as_slice()?),
            (None, Some(sixteen)) => SampleSlice::Sixteen(sixteen.as_slice()?),
            (None, None) => SampleSlice::Eight(&[]),
        };
        let image =
            PrintImage::from_samples([width, height], channels, samples).ok_or_else(|| {
                raise(
                    py,
                    "ImageError",
                    "bad_input",
                    "the image has no pixels",
                    None,
                )
            })?;
        Ok(Self {
            print: Arc::new(image.into()),
            path: None,
        })
    }

    /// Returns width and height.
    fn size(&self) -> (usize, usize) {
        let rgb = &self.image().rgb;
        (rgb.width(), rgb.height())
    }

    /// Returns the colours in 8 bits.
    fn rgb8<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u8>> {
        PyArray1::from_vec(py, self.image().to_rgb8())
    }

    /// Returns the colours in 16 bits.
    fn rgb16<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u16>> {
        PyArray1::from_slice(py, self.image().rgb.data().as_flattened())
    }

    /// Returns what may be wrong with the colours.
    fn warnings(&self) -> Vec<String> {
        self.image().profile_warning().into_iter().collect()
    }

    /// Returns the ink of the likeliest interpretation.
    fn ink<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let print = Arc::clone(&self.print);
        let ink = compute(py, move || normalize::likeliest_ink(&print))?;
        let ink = ink.map_err(|error| {
            let text = error.to_string();
            raise(
                py,
                "ImageError",
                error.class().name(),
                &text,
                self.path.as_deref(),
            )
        })?;
        Ok(PyArray1::from_slice(py, ink.data()))
    }
}

/// Reads the file of a print.
#[pyfunction]
pub(crate) fn read_print(
    py: Python<'_>,
    path: PathBuf,
    settings: &NativeSettings,
) -> PyResult<NativePrint> {
    let (file, limits) = (path.clone(), settings.limits);
    let read = compute(py, move || align::read_print(&file, &limits))?;
    let content = read.map_err(|error| unreadable(py, "ImageError", &error, &path))?;
    let print = content.map_err(|failure| {
        raise(
            py,
            "ImageError",
            failure.class.name(),
            &failure.message,
            Some(&path),
        )
    })?;
    Ok(NativePrint {
        print: Arc::new(print),
        path: Some(path),
    })
}
