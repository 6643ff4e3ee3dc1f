//! The one plot layer of reports and charts.

pub(crate) mod chart;
pub mod palette;
pub mod panel;
