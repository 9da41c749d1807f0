//! Every row that the core adds to the validation table is within its tolerance.

mod rows;

use vpm_core::Result;

/// One group: its rows are there and hold.
fn check(name: &str) -> Result<()> {
    let mut found = Vec::new();
    for (_, make) in rows::GROUPS.iter().filter(|(group, _)| *group == name) {
        found.extend(make()?);
    }
    assert!(!found.is_empty(), "{name} has no rows");
    let off: Vec<_> = found.iter().filter(|row| !row.holds()).map(|row| row.json().to_string()).collect();
    assert!(off.is_empty(), "{off:#?}");
    Ok(())
}

macro_rules! groups {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() -> Result<()> {
            check(stringify!($name))
        })*
        #[test]
        fn every_group_is_checked() {
            assert_eq!(rows::GROUPS.map(|(name, _)| name), [$(stringify!($name)),*]);
        }
    };
}
groups! { derivations slopes conservation orders rolling limits bases segments }
