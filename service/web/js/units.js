// Values as people read them: lengths in the unit they chose, angles in degrees.

const METRES = { m: 1, cm: 0.01, mm: 0.001, in: 0.0254, ft: 0.3048 };
const DIGITS = { m: 3, cm: 1, mm: 0, in: 2, ft: 3, rad: 1, 1: 2 };
const DEGREE = Math.PI / 180;

export class Units extends EventTarget {
  static choices = ["m", "cm", "mm", "in"];

  constructor() {
    super();
    this.unit = "m";
  }

  choose(unit) {
    this.unit = unit;
    this.dispatchEvent(new Event("change"));
  }

  /** What is written behind a value that the service gives in `unit`. */
  label(unit) {
    return unit in METRES ? this.unit : { rad: "°", 1: "sd" }[unit] ?? "";
  }

  spoken(unit) {
    const names = { m: "metres", cm: "centimetres", mm: "millimetres", in: "inches", rad: "degrees" };
    return names[unit in METRES ? this.unit : unit] ?? "standard deviations";
  }

  toShown(value, unit) {
    if (unit in METRES) return (value * METRES[unit]) / METRES[this.unit];
    return unit === "rad" ? value / DEGREE : value;
  }

  fromShown(value, unit) {
    if (unit in METRES) return (value * METRES[this.unit]) / METRES[unit];
    return unit === "rad" ? value * DEGREE : value;
  }

  digits(unit) {
    return DIGITS[unit in METRES ? this.unit : unit] ?? 2;
  }

  /** The number alone, as a number field holds it. */
  number(value, unit) {
    const text = this.toShown(value, unit).toFixed(this.digits(unit));
    return Number(text) === 0 ? (0).toFixed(this.digits(unit)) : text;
  }

  text(value, unit) {
    const label = this.label(unit);
    return `${this.number(value, unit)}${label === "°" ? "" : "\u202f"}${label}`;
  }
}
