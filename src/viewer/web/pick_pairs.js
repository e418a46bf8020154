// Pairs of vertices: what is done to them and undone, their file, and names of left and right. Nothing here is drawn.

/** A pair: the vertex of each side or null, a name, and a confidence that was read with it or null. */
const empty = (name) => ({ source: null, target: null, name, confidence: null });
export const complete = ({ source, target }) => source !== null && target !== null;

export class Pairs {
  constructor(onChange) {
    [this.list, this.chosen, this.past, this.future, this.saved] = [[], -1, [], [], []];
    this.onChange = onChange;
  }

  /** Whether the file differs from what is here. */
  get dirty() { return this.saved !== this.list; }

  /** Another list, which can be taken back. */
  change(list, chosen) {
    this.past.push([this.list, this.chosen]);
    this.future = [];
    [this.list, this.chosen] = [list, chosen];
    this.onChange();
  }

  step(from, to) {
    if (!from.length) return false;
    to.push([this.list, this.chosen]);
    [this.list, this.chosen] = from.pop();
    this.onChange();
    return true;
  }

  undo() { return this.step(this.past, this.future); }

  redo() { return this.step(this.future, this.past); }

  choose(k) {
    this.chosen = k;
    this.onChange();
  }

  /** Puts a side of the chosen pair at a vertex, or begins a pair there; whether the pair is complete now. */
  place(side, vertex, name) {
    const is_new = this.chosen < 0;
    const list = is_new ? [...this.list, empty(name)] : [...this.list];
    const k = is_new ? list.length - 1 : this.chosen;
    list[k] = { ...list[k], [side]: vertex, confidence: null };
    const is_whole = complete(list[k]);
    this.change(list, is_whole ? -1 : k);
    return is_whole;
  }

  remove(k) {
    const others = this.list.filter((_, j) => j !== k);
    this.change(others, this.chosen === k ? -1 : this.chosen > k ? this.chosen - 1 : this.chosen);
  }

  rename(k, name) {
    if (this.list[k].name !== name) this.change(this.list.map((pair, j) => (j === k ? { ...pair, name } : pair)), this.chosen);
  }

  /** The name of the other side of the last pair that has one, unless a pair has it already. */
  mirrored() {
    const last = [...this.list].reverse().find(complete);
    const other = last && mirror(last.name);
    return other && !this.list.some(({ name }) => name.toLowerCase() === other.toLowerCase()) ? other : null;
  }
}

const SIDES = { left: 'right', right: 'left', l: 'r', r: 'l' };

/** A name with left and right exchanged, as a word or as the letter L or R alone; null if it has neither. */
export function mirror(name) {
  const side = /(^|[^a-z])(left|right|l|r)(?![a-z])/i;
  if (!side.test(name)) return null;
  return name.replace(new RegExp(side, 'gi'), (_, before, word) => {
    const other = SIDES[word.toLowerCase()];
    if (word === word.toUpperCase()) return before + other.toUpperCase();
    return before + (word[0] === word[0].toUpperCase() ? other[0].toUpperCase() + other.slice(1) : other);
  });
}

/** The text of the file. A name stands in a comment before its pair; half pairs are left out. */
export function written(list) {
  const whole = list.filter(complete), sure = whole.some(({ confidence }) => confidence !== null);
  const lines = whole.map(({ source, target, name, confidence }) => {
    const comment = name.trim() ? `# name: ${name.replace(/\s+/g, ' ').trim()}\n` : '';
    return `${comment}${source},${target}${sure ? `,${confidence === null ? 1 : confidence}` : ''}\n`;
  });
  return `source_index,target_index${sure ? ',confidence' : ''}\n${lines.join('')}`;
}

/** The pairs of a file of vertices that are below these counts; throws with the line that is none. */
export function read(text, counts) {
  const found = [];
  let name = '', may_be_names = true;
  text.replace(/^\ufeff/, '').split(/\r?\n/).forEach((given, at) => {
    const line = given.trim();
    if (line.startsWith('#')) name = (/^#\s*name:\s*(.*)$/.exec(line) || ['', name])[1];
    if (!line || line.startsWith('#')) return;
    const is_first = may_be_names;
    may_be_names = false;
    if (is_first && /^\p{Alphabetic}/u.test(line)) return;
    const [source, target, confidence, ...more] = line.split(',').map((part) => part.trim());
    const is_vertex = (part) => part !== undefined && /^\+?\d+$/.test(part);
    const is_share = confidence === undefined || (confidence !== '' && Number(confidence) >= 0 && Number(confidence) <= 1);
    if (!is_vertex(source) || !is_vertex(target) || !is_share || more.length) throw new Error(`line ${at + 1}: "${line.slice(0, 60)}" is not source_index,target_index`);
    [source, target].forEach((vertex, side) => {
      if (Number(vertex) >= counts[side]) throw new Error(`line ${at + 1}: the ${['source', 'target'][side]} has no vertex ${vertex}, only 0 to ${counts[side] - 1}`);
    });
    found.push({ source: Number(source), target: Number(target), name, confidence: confidence === undefined ? null : Number(confidence) });
    name = '';
  });
  return found;
}

/** A colour for pair k that differs from those before it; white letters are read on it. */
export const colourOf = (k) => `hsl(${((k * 137.508 + 212) % 360).toFixed(0)} 72% ${k % 2 ? 36 : 42}%)`;
