//! The tests of `tesdf-cli` over several of its modules, in one program.
mod asset_cache;
mod bad_input;
mod check_and_repair;
mod clearance_and_toi;
mod command_line;
mod conforming_domains;
#[cfg(feature = "gpu")]
mod devices;
mod encode_all;
mod encode_query_verify;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod faults;
mod folder;
mod inside;
#[cfg(target_os = "linux")]
mod interrupts;
mod json_keys;
#[cfg(unix)]
mod kills;
#[cfg(target_os = "linux")]
mod limits;
mod messages;
mod outlines;
#[cfg(target_os = "linux")]
mod outputs;
mod parts;
mod playback;
mod render_picture;
mod resume;
mod robots;
mod simulate;
mod slice_picture;
mod split;
mod tes_json;
