//! From a scene file to records: scene → world → plan → stepper → record.

pub mod record;
pub mod stepper;
pub mod system;
