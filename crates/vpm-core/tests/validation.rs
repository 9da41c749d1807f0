//! Every row that the core adds to the validation table is within its tolerance.

mod rows;

/// One group: its rows are there, each with its own name, and hold.
fn check(name: &str) {
    let (_, make) = rows::GROUPS.into_iter().find(|(group, _)| *group == name).unwrap();
    let found = make().unwrap();
    assert!(!found.is_empty(), "{name} has no rows");
    let off: Vec<_> = found.iter().filter(|row| !row.holds()).map(|row| row.json().to_string()).collect();
    assert!(off.is_empty(), "{off:#?}");
}

macro_rules! groups {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            check(stringify!($name));
        })*
        #[test]
        fn every_group_is_checked() {
            assert_eq!(rows::GROUPS.map(|(name, _)| name), [$(stringify!($name)),*]);
        }
    };
}
groups! { derivations slopes conservation orders rolling limits bases segments }
