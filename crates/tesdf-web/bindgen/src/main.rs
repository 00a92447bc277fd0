//! Writes the JavaScript and the types around a `.wasm` file: `tesdf-web-bindgen IN.wasm FOLDER`.
//! It is the command `wasm-bindgen --target web`, without what that needs for other uses.
use wasm_bindgen_cli_support::Bindgen;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, folder] = arguments.as_slice() else { panic!("expected IN.wasm FOLDER") };
    let mut bindgen = Bindgen::new();
    let web = bindgen
        .input_path(input)
        .out_name("tesdf")
        .typescript(true)
        .omit_default_module_path(false)
        .web(true)
        .expect("web");
    web.remove_producers_section(true)
        .remove_name_section(true)
        .generate(folder)
        .expect("the files can be written");
}
