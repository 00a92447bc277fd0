//! Tells a function of JavaScript how far an encoding is.
use std::cell::{Cell, RefCell};

use js_sys::Function;
use tesdf::base::Named;
use tesdf::{Progress, Stage};
use wasm_bindgen::JsValue;

/// The function is called when so much more of a stage is done.
const STEP: f64 = 0.01;

thread_local! {
    // A function of JavaScript stays on its thread, and `Progress` may go to others.
    static TOLD: RefCell<Option<Function>> = const { RefCell::new(None) };
    static LAST: Cell<(Option<Stage>, f64)> = const { Cell::new((None, 0.0)) };
}

/// Does `work` with a progress that calls the function.
pub fn watched<T>(told: Option<Function>, work: impl FnOnce(&Progress) -> T) -> T {
    TOLD.set(told);
    LAST.set((None, 0.0));
    let result = work(&Progress::telling(tell));
    TOLD.set(None);
    result
}

fn tell(progress: &Progress) {
    let (stage, share) = progress.state();
    let (last, before) = LAST.get();
    if last == Some(stage) && share < before + STEP {
        return;
    }
    LAST.set((Some(stage), share));
    let told = TOLD.with_borrow(Clone::clone);
    let answer = told.map(|told| told.call2(&JsValue::NULL, &stage.name().into(), &share.into()));
    // An error of the function stops the encoding, too.
    if answer.is_some_and(|answer| answer.is_err() || answer == Ok(JsValue::FALSE)) {
        progress.cancel();
    }
}
