//! Damage with a sense of structure, and the limits of a case.

use libfuzzer_sys::fuzzer_mutate;
use rustix::time::{ClockId, clock_gettime};
use serde_json::{Number, Value};

/// Processor time that a case may take, s.
const SECONDS: i64 = 10;

/// Random numbers that follow from a seed (Marsaglia's xorshift).
struct Dice(u64);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % count.max(1) as u64) as usize
    }
}

/// What stands in the place of something else.
fn hostile(dice: &mut Dice) -> Value {
    let numbers = [0.0, -0.0, -1.0, 1e-300, 1e-9, 1e9, 1e155, 1e308, -1e308, f64::MIN_POSITIVE, 0.5, 2.0];
    match dice.below(8) {
        0 => Value::from(u64::MAX >> dice.below(2)),
        1 => Value::from(dice.below(9)),
        2 => Value::Null,
        3 => Value::from("x"),
        4 => Value::Array(Vec::new()),
        5 => Value::Object(serde_json::Map::new()),
        _ => Value::from(numbers[dice.below(numbers.len())]),
    }
}

/// Values of a document.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(list) => list.iter().map(count).sum(),
        Value::Object(table) => table.values().map(count).sum(),
        _ => 0,
    }
}

/// Value number `place` of a document.
fn at<'a>(value: &'a mut Value, place: &mut usize) -> Option<&'a mut Value> {
    if *place == 0 {
        return Some(value);
    }
    *place -= 1;
    match value {
        Value::Array(list) => list.iter_mut().find_map(|inner| at(inner, place)),
        Value::Object(table) => table.values_mut().find_map(|inner| at(inner, place)),
        _ => None,
    }
}

fn change(whole: &mut Value, dice: &mut Dice) {
    let places = count(whole);
    let other = at(whole, &mut dice.below(places)).cloned();
    let Some(value) = at(whole, &mut dice.below(places)) else { return };
    match (value, dice.below(4)) {
        (Value::Array(list), 0) => drop((!list.is_empty()).then(|| list.remove(dice.below(list.len())))),
        (Value::Array(list), 1) => list.extend(list.first().cloned()),
        (Value::Object(table), 0 | 1) => {
            let key = table.keys().nth(dice.below(table.len())).cloned();
            key.map(|key| table.remove(&key));
        }
        (Value::Number(number), 0 | 1) => {
            let by = [0.1, 0.5, 2.0, 10.0, 1e3, -1.0][dice.below(6)];
            let changed = number.as_f64().and_then(|number| Number::from_f64(number * by));
            *number = changed.unwrap_or_else(|| Number::from(dice.below(9)));
        }
        (value, 2) => *value = other.unwrap_or_default(),
        (value, _) => *value = hostile(dice),
    }
}

/// Mostly a change of the document, sometimes one of its bytes: the new size of `data`.
pub fn mutate(data: &mut [u8], size: usize, most: usize, seed: u32) -> usize {
    let mut dice = Dice(u64::from(seed) << 1 | 1);
    (0..3).for_each(|_| {
        dice.below(2);
    });
    let document = serde_json::from_slice::<Value>(&data[..size]).ok().filter(|_| dice.below(5) > 0);
    let Some(mut document) = document else { return fuzzer_mutate(data, size, most) };
    for _ in 0..=dice.below(3) {
        change(&mut document, &mut dice);
    }
    let text = document.to_string();
    if text.len() > most {
        return fuzzer_mutate(data, size, most);
    }
    data[..text.len()].copy_from_slice(text.as_bytes());
    text.len()
}

/// Does some work within its processor time.
pub fn limited(work: impl FnOnce()) {
    let spent = || clock_gettime(ClockId::ThreadCPUTime).tv_sec;
    let begin = spent();
    work();
    assert!(spent() - begin <= SECONDS, "a case takes {} s of the processor", spent() - begin);
}
