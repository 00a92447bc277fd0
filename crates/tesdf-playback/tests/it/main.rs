//! The tests of `tesdf-playback` over several of its modules, in one program.
mod glb;
mod live;
mod page;
mod support;
