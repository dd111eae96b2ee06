//! The report's numbers and forms.
