//! The tests of `tesdf-parts` over several of its modules, in one program.
mod any_parameters;
mod bolts_and_nuts;
mod fingers_and_spoons;
mod gears_and_shafts;
mod pegs_and_links;
mod solid;
