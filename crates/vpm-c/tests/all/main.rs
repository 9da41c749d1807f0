//! The C library, as C sees it.

#![cfg(test)]

mod calls;
mod example;
mod header;
mod hostile;
mod support;
