//! Contacts and bushings, alone and in machines.

mod bushing;
mod leg;
mod machine_bushing;
mod machine_contact;
mod point_and_plane;
