//! Messages of the library in Python's terms: it speaks of the tool's commands and flags.

/// What the library says outside of code, and what Python has in its place.
const PHRASES: [(&str, &str); 8] = [
    ("tesdf encode MESH -o FILE.tesdf", "tesdf.encode(mesh).save(\"FILE.tesdf\")"),
    ("`tesdf simulate` writes runs", "Simulation.save writes runs"),
    ("that tesdf encode wrote", "that Asset.save wrote"),
    ("encode the mesh without --unit", "encode the mesh without unit"),
    ("The repair `auto`", "`repair=\"auto\"`"),
    ("The rule `nonzero`", "`inside=\"nonzero\"`"),
    ("The rule `generalized`", "`inside=\"generalized\"`"),
    ("The rule `sheet`", "`inside=\"sheet\"`"),
];

/// A message with `--flag value` and `tesdf command` within backticks as Python has them:
/// `flag="value"` and `tesdf.command(mesh)`.
pub fn in_python(message: &str) -> String {
    let mut text = message.to_string();
    for (of_tool, of_python) in PHRASES {
        text = text.replace(of_tool, of_python);
    }
    // `give --package NAME=PATH, or set ROS_PACKAGE_PATH`
    if let Some(at) = text.find("give --package ")
        && let Some(end) = text[at..].find("set ")
    {
        text.replace_range(at..at + end, "");
    }
    let mut parts: Vec<String> = text.split('`').map(str::to_string).collect();
    // Text and code alternate. Without its second backtick, the last part is text.
    let whole = parts.len() - (parts.len() + 1) % 2;
    for code in parts[..whole].iter_mut().skip(1).step_by(2) {
        *code = code_in_python(code);
    }
    parts.join("`")
}

fn code_in_python(code: &str) -> String {
    let mut words = code.split(' ').peekable();
    let command = match (code.strip_prefix("tesdf "), code.starts_with("--")) {
        (Some(_), _) => words.nth(1),
        (None, true) => None,
        (None, false) => return code.to_string(),
    };
    let mut arguments: Vec<String> = Vec::new();
    while let Some(word) = words.next() {
        let value = |word: &&str| !word.starts_with('-') || word.parse::<f64>().is_ok();
        if let Some(flag) = word.strip_prefix("--") {
            let flag = flag.replace('-', "_");
            arguments.push(match words.next_if(value) {
                Some(value) if value.parse::<f64>().is_ok() => format!("{flag}={value}"),
                Some(value) => format!("{flag}=\"{value}\""),
                None => format!("{flag}=True"),
            });
        } else if word.starts_with('-') {
            // `-o FILE`: functions return what they make.
            words.next_if(value);
        } else {
            arguments.push(word.to_lowercase());
        }
    }
    let arguments = arguments.join(", ");
    match command {
        Some(command) if arguments.is_empty() => format!("tesdf.{command}"),
        Some(command) => format!("tesdf.{command}({arguments})"),
        None => arguments,
    }
}
