//! The tests of `tesdf-rapier` over several of its modules, in one program.
mod dispatcher;
mod engine;
mod support;
