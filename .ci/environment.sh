# Sourced: virtual environments of Python.

python=${PYTHON:-python3}

# scripts_of ENVIRONMENT: the folder with the programs of a virtual environment.
scripts_of() {
    if [ -d "$1/Scripts" ]; then echo "$1/Scripts"; else echo "$1/bin"; fi
}

# environment_with ENVIRONMENT REQUIREMENT…: a virtual environment with these packages, made anew where
# they have changed.
environment_with() {
    local list=$1/requirements.txt requirements=${*:2}
    if [ "$(cat "$list" 2>/dev/null)" = "$requirements" ]; then
        return
    fi
    "$python" -m venv --clear "$1" &&
        "$(scripts_of "$1")/python" -m pip --disable-pip-version-check install --quiet "${@:2}" &&
        echo "$requirements" >"$list"
}
