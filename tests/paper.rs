//! The paper's tables, figures and claims in their short form.

mod chains;
mod rigid;
mod specimens;
