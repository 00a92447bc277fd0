//! Tells the tool of which commit it is, for `tesdf --version`: in `TESDF_COMMIT`, its short hash
//! and date. Builds without optimisation name none, so that a commit makes cargo build nothing
//! again. Neither do builds from a package, which is no checkout.
use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let variable = |name| std::env::var(name).unwrap_or_default();
    let folder = variable("CARGO_MANIFEST_DIR");
    // A package that another project's checkout holds must not name a commit of that project.
    let is_checkout = Path::new(&folder).join("../../.git").exists()
        && Path::new(&folder).ends_with("crates/tesdf-cli")
        && !Path::new(&folder).join(".cargo_vcs_info.json").exists();
    if variable("PROFILE") != "release" || !is_checkout {
        return;
    }
    let git = |args: &[&str]| -> Option<String> {
        let out = Command::new("git").arg("-C").arg(&folder).args(args).output().ok()?;
        out.status.success().then(|| String::from_utf8_lossy(&out.stdout).trim().to_owned())
    };
    // The first changes when another branch is checked out, the second with each commit.
    for file in ["HEAD", "logs/HEAD"] {
        let path = git(&["rev-parse", "--path-format=absolute", "--git-path", file]);
        // Cargo would run this program at each build for a file that is not there.
        if let Some(path) = path.filter(|path| Path::new(path).exists()) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
    if let Some(commit) = git(&["log", "-1", "--abbrev=7", "--format=%h %cs"]) {
        println!("cargo:rustc-env=TESDF_COMMIT={commit}");
    }
}
