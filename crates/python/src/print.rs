//! The image of a print, from an array or a file.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::compute::{NativeCancel, compute};
use crate::failure::{raise, unreadable};
use crate::settings::NativeSettings;
use mocban_align::stages::{Print, normalize};
use mocban_core::locked;
use mocban_core::raster::{PrintSamples, SampleSlice};
use mocban_project::align::{self, ReadPrint};

/// The image of a print and its file.
#[pyclass(frozen, module = "mocban._native")]
pub(crate) struct NativePrint {
    source: Arc<Mutex<PrintSource>>,
    #[pyo3(get)]
    pub(crate) path: Option<PathBuf>,
    /// Width and height.
    #[pyo3(get)]
    size: (usize, usize),
    /// What may be wrong with the colours.
    #[pyo3(get)]
    warning: Option<String>,
    /// Pixels per inch, from left to right and from top to bottom.
    #[pyo3(get)]
    dpi: Option<(f64, f64)>,
}

/// The samples of an array until the image is needed, so that creating a print only copies them.
enum PrintSource {
    Samples(PrintSamples),
    Image(Arc<Print>),
}

impl NativePrint {
    /// Returns a function that returns the image, for use without the GIL.
    pub(crate) fn image(&self) -> impl FnOnce() -> Arc<Print> + Send + use<> {
        let source = Arc::clone(&self.source);
        move || {
            let mut source = locked(&source);
            let print = match &*source {
                PrintSource::Image(print) => return Arc::clone(print),
                PrintSource::Samples(samples) => Arc::new(samples.to_image().into()),
            };
            *source = PrintSource::Image(Arc::clone(&print));
            print
        }
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
        let samples = PrintSamples::copied([width, height], channels, samples);
        let samples = samples.ok_or_else(|| {
            let text = "the image has no pixels";
            raise(py, "ImageError", "bad_input", text, None)
        })?;
        Ok(Self {
            path: None,
            size: samples.size().into(),
            warning: None,
            dpi: None,
            source: Arc::new(Mutex::new(PrintSource::Samples(samples))),
        })
    }

    /// Returns the colours in 8 bits.
    fn rgb8<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let image = self.image();
        let colours = compute(py, None, move || image().image().rgb.to_rgb8().into_owned())?;
        Ok(PyArray1::from_slice(py, colours.data().as_flattened()))
    }

    /// Returns the colours in 16 bits.
    fn rgb16<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u16>>> {
        let print = compute(py, None, self.image())?;
        let colours = print.image().rgb.to_rgb16();
        Ok(PyArray1::from_slice(py, colours.data().as_flattened()))
    }

    /// Returns the ink of the likeliest interpretation.
    fn ink<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let image = self.image();
        let ink = compute(py, None, move || normalize::likeliest_ink(&image()))?;
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
    cancel: Option<&NativeCancel>,
) -> PyResult<NativePrint> {
    let (file, limits) = (path.clone(), settings.limits);
    let read = compute(py, cancel, move || align::read_print(&file, &limits))?;
    let content = read.map_err(|error| unreadable(py, "ImageError", &error, &path))?;
    let ReadPrint { print, dpi } = content.map_err(|failure| {
        raise(
            py,
            "ImageError",
            failure.class.name(),
            &failure.message,
            Some(&path),
        )
    })?;
    let rgb = &print.image().rgb;
    Ok(NativePrint {
        path: Some(path),
        size: (rgb.width(), rgb.height()),
        warning: print.image().profile_warning(),
        dpi: dpi.map(Into::into),
        source: Arc::new(Mutex::new(PrintSource::Image(Arc::new(print)))),
    })
}
