// SPDX-License-Identifier: BSD-3-Clause
// Draws what the events say. Text from the nodes becomes text of the page, never markup.
"use strict";
const SILENT = 5;        // s without an event, sent each second: the server is lost
const UNITS = {m: [1e6, "\u00b5m"], rad: [1e3, "mrad"]};
const GRADES = {good: "good", watch: "watch", service: "service", stop: "stop", ungraded: "no limits set",
                cannot_tell: "not estimated", stale: "no samples", gone: "diagnoser is gone"};
const CLASSES = ["good", "watch", "service", "stop", "ungraded", "cannot_tell", "stale", "gone"];
const SVG = "http://www.w3.org/2000/svg";
const cards = new Map();
let heard = performance.now(), lastTime = null;

function digits(value) {
  return Math.abs(value) >= 1000 ? value.toFixed(0) : String(Number(value.toPrecision(3)));
}

function clock(seconds) {
  return seconds ? new Date(seconds * 1000).toISOString().slice(11, 19) + " UTC" : "?";
}

function moment(seconds) {
  return new Date(seconds * 1000).toISOString().slice(0, 19).replace("T", " ") + " UTC";
}

function span(seconds) {
  return seconds < 120 ? seconds.toFixed(0) + " s" : seconds < 7200 ? (seconds / 60).toFixed(0) + " min" :
    seconds < 172800 ? (seconds / 3600).toFixed(1) + " h" : (seconds / 86400).toFixed(1) + " days";
}

// Sentences of the nodes in the page's unit.
function ownUnit(text) {
  const number = "(-?\\d+(?:\\.\\d+)?(?:e[+-]?\\d+)?)";
  for (const unit of ["rad", "m"]) {
    const [factor, name] = UNITS[unit], own = value => digits(factor * Number(value));
    text = text.replace(new RegExp(`${number} ${unit} \\(95 %: ${number} to ${number}\\)`, "g"),
                        (_, v, low, high) => `${own(v)} ${name} (95 %: ${own(low)} to ${own(high)})`)
      .replace(new RegExp(`${number} to ${number} ${unit}(?![\\w/^])`, "g"), (_, low, high) => `${own(low)} to ${own(high)} ${name}`)
      .replace(new RegExp(`${number} ${unit}(?![\\w/^])`, "g"), (_, v) => `${own(v)} ${name}`);
  }
  return text.replace(/\d+\.\d{6,}/g, long => String(Number(Number(long).toPrecision(4))));
}

function svg(width, height, label) {
  const root = document.createElementNS(SVG, "svg");
  root.setAttribute("viewBox", `0 0 ${width} ${height}`);
  root.setAttribute("role", "img");
  root.setAttribute("aria-label", label);
  return root;
}

function add(parent, name, attributes, text) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function known(joint) {
  const [low, high] = joint.interval || [null, null];
  return {low, high, any: joint.value !== null || high !== null};
}

function intervalWords(joint) {
  const [factor, unit] = UNITS[joint.unit];
  const {low, high} = known(joint);
  if (joint.value === null && high !== null) return `at most ${digits(factor * high)} ${unit}`;
  if (joint.value === null) return "no play estimated";
  const ends = low !== null && high !== null ? ` (95 %: ${digits(factor * low)} to ${digits(factor * high)})` : "";
  return `${digits(factor * joint.value)} ${unit}${ends}`;
}

// The interval on a line from zero, with the zones of the limits behind it.
function bar(joint) {
  const {low, high, any} = known(joint);
  if (!any) return null;
  const [factor, unit] = UNITS[joint.unit], width = 400, height = 46, limits = joint.limits;
  const top = 1.15 * Math.max(high === null ? joint.value : high, limits ? limits[2] : 0, 1e-12);
  const x = v => Math.max(0, Math.min(width, width * v / top));
  const root = svg(width, height, `interval of the play of ${joint.joint}`);
  const zones = limits ? [["good", 0, limits[0]], ["watch", limits[0], limits[1]], ["service", limits[1], limits[2]],
                          ["stop", limits[2], top]] : [["none", 0, top]];
  for (const [name, from, to] of zones)
    add(root, "rect", {class: "zone-" + name, x: x(from), y: 4, width: Math.max(0, x(to) - x(from)), height: 20});
  const from = low === null ? 0 : low, to = high === null ? top : high;
  add(root, "path", {class: "interval", d: `M${x(from)} 14H${Math.max(x(to), x(from) + 2)}`});
  if (joint.value !== null) add(root, "path", {class: "value", d: `M${x(joint.value)} 5V23`});
  add(root, "text", {x: 0, y: 40}, "0");
  let end = 12;
  for (const [place, value] of (limits || []).entries()) {
    const name = ["watch", "service", "stop"][place], words = `${name} ${digits(factor * value)}`;
    if (x(value) - 3 * words.length < end || x(value) + 3 * words.length > width) continue;
    add(root, "text", {x: x(value), y: 40, "text-anchor": "middle"}, words);
    end = x(value) + 3.2 * words.length;
  }
  return [root, limits ? `Interval of the play against the limits, in ${unit}` : `Interval of the play, in ${unit}; no limits are set`];
}

function curve(joint) {
  const points = joint.curve;
  if (!points || points.length < 2) return null;
  const [factor, unit] = UNITS[joint.unit], width = 400, height = 120, left = 44;
  const times = points.map(p => p[0]), first = times[0], last = times[times.length - 1];
  const values = points.flatMap(p => [p[1], p[2], p[3]]).filter(v => v !== null);
  let most = Math.max(...values);
  const near = (joint.limits || []).filter(l => l < 2.5 * most);
  most = 1.08 * Math.max(most, ...near);
  const x = t => left + (width - left - 4) * (last > first ? (t - first) / (last - first) : 0);
  const y = v => (height - 22) * (1 - v / most) + 6;
  const root = svg(width, height, `play of ${joint.joint} over time`);
  add(root, "path", {class: "axis", d: `M${left} ${y(0)}H${width - 4}M${left} 6V${y(0)}`});
  for (const limit of near) add(root, "path", {class: "limit", d: `M${left} ${y(limit)}H${width - 4}`});
  const sure = points.filter(p => p[2] !== null && p[3] !== null);
  if (sure.length > 1)
    add(root, "path", {class: "band", d: "M" + sure.map(p => `${x(p[0])} ${y(p[3])}`).join("L") + "L" +
                                         sure.slice().reverse().map(p => `${x(p[0])} ${y(p[2])}`).join("L") + "Z"});
  add(root, "path", {class: "line", d: "M" + points.map(p => `${x(p[0])} ${y(p[1])}`).join("L")});
  if (joint.change && joint.change.since >= first && joint.change.since <= last)
    add(root, "path", {class: "since", d: `M${x(joint.change.since)} 6V${y(0)}`});
  for (const value of [0, most / 1.08])
    add(root, "text", {x: left - 5, y: y(value) + 4, "text-anchor": "end"}, digits(factor * value));
  add(root, "text", {x: left, y: height - 2}, clock(first));
  add(root, "text", {x: width - 4, y: height - 2, "text-anchor": "end"}, clock(last));
  return [root, `Estimates of ${span(last - first)}, in ${unit}` + (near.length ? "; dashed: limits" : "")];
}

function fill(holder, words, made) {
  holder.replaceChildren(...(made ? [made[0]] : []));
  put(words, made ? made[1] : "");
}

// Methods without an answer: those that another motion would serve, in words; those that the machine or its file has nothing for,
// as a line to open.
function silent(holder, joint) {
  const open = holder.querySelector("details") !== null && holder.querySelector("details").open;
  holder.replaceChildren();
  const item = each => {
    const line = document.createElement("li");
    line.textContent = `${each.method}: ${ownUnit(each.message)}`;
    return line;
  };
  const lacking = (joint.silent || []).filter(each => !each.of_rig), unserved = (joint.silent || []).filter(each => each.of_rig);
  if (lacking.length) {
    const words = document.createElement("p"), list = document.createElement("ul");
    words.textContent = "Could not estimate the play:";
    list.append(...lacking.map(item));
    holder.append(words, list);
  }
  if (!unserved.length) return;
  const details = document.createElement("details"), words = document.createElement("summary"), list = document.createElement("ul");
  words.textContent = `${unserved.length} method${unserved.length > 1 ? "s" : ""} cannot be used with this rig file`;
  words.className = "small";
  details.open = open;
  list.append(...unserved.map(item));
  details.append(words, list);
  holder.append(details);
}

function changeWords(joint) {
  const change = joint.change, watch = joint.watch;
  if (change) return `${{standing: "Changed", ended: "Was changed", unseen: "No longer seen"}[change.state] || change.state}: ${ownUnit(change.text)}`;
  if (!watch) return "";
  if (watch.gone) return "The change watch is gone.";
  return `Change watch: ${ownUnit(watch.message)}`;
}

function answerWords(answer) {
  if (!answer) return "";
  const what = answer.what === "diagnose" ? "Diagnosis" : "Baseline";
  return `${what} at ${clock(answer.time)}${answer.success ? "" : ", no result"}: ${ownUnit(answer.message)}`;
}

async function press(path, joint, button) {
  button.disabled = true;
  const words = button.textContent;
  button.textContent = "asked ...";
  const answer = button.closest("section").querySelector(".answer");
  try {
    const response = await fetch(path, {method: "POST", headers: {"Content-Type": "application/json", "X-Button": "1"},
                                        body: JSON.stringify({node: joint.node, joint: joint.joint})});
    if (!response.ok) put(answer, "No result: " + (await response.text()).trim());
  } catch (error) {
    put(answer, "No result: the server of this page does not answer.");
  }
  button.textContent = words;
  button.disabled = false;
}

function card(key) {
  if (cards.has(key)) return cards.get(key);
  const section = document.getElementById("card").content.firstElementChild.cloneNode(true);
  const made = {section, joint: null, drawn: ""};
  section.querySelector(".diagnose").addEventListener("click", e => press("diagnose", made.joint, e.target));
  section.querySelector(".baseline").addEventListener("click", e => press("set_baseline", made.joint, e.target));
  cards.set(key, made);
  document.getElementById("joints").append(section);
  return made;
}

function draw(joint) {
  const made = card(`${joint.node}\n${joint.joint}`), section = made.section, find = name => section.querySelector(name);
  const before = made.joint && made.joint.answer;
  made.joint = joint;
  section.dataset.joint = joint.joint;
  section.dataset.node = joint.node || "";
  put(find("h2"), joint.joint);
  // A joint that stands changed is none to be left alone, however little play it has.
  const grade = joint.grade || "", changed = joint.change && joint.change.state === "standing";
  const colour = changed && ["", "good", "ungraded", "cannot_tell"].includes(grade) ? "watch" : grade;
  section.className = "joint " + (CLASSES.includes(colour) ? colour : "");
  put(find(".grade"), (grade ? GRADES[grade] || grade : "change watch only") + (changed ? ", changed" : ""));
  for (const name of [".buttons", ".headline"]) find(name).hidden = joint.node === null;
  put(find(".message"), ownUnit(joint.message || "") + (joint.asked ? `, asked at ${clock(joint.asked)}` : ""));
  put(find(".change"), changeWords(joint));
  find(".change").classList.toggle("over", joint.change ? joint.change.state !== "standing" : !joint.watch || joint.watch.gone || joint.watch.level === "ok");
  if (joint.node !== null) {
    put(find(".headline"), intervalWords(joint));
    fill(find(".bar"), find(".bar-words"), bar(joint));
    fill(find(".curve"), find(".curve-words"), curve(joint));
    silent(find(".silent"), joint);
    put(find(".input"), joint.input ? `Input: ${joint.input.message}` + (joint.input.rate ? `, ${digits(joint.input.rate)} Hz` : "") +
        (joint.age === null ? "" : `; last new estimate ${span(joint.age)} ago`) : "");
    find(".input").classList.toggle("old", Boolean(joint.old));
    if (JSON.stringify(before) !== JSON.stringify(joint.answer)) {
      put(find(".answer"), answerWords(joint.answer));
      find(".answer").classList.toggle("failed", Boolean(joint.answer && !joint.answer.success));
    }
  }
}

function summary(joints) {
  if (!joints.length) return "No diagnoser and no change watch has reported yet.";
  const count = wanted => joints.filter(j => wanted.includes(j.grade)).map(j => j.joint);
  const parts = [["stop", ["stop"]], ["need service", ["service"]], ["to watch", ["watch"]],
                 ["not estimated", ["cannot_tell"]], ["without samples", ["stale", "gone"]]]
    .map(([words, grades]) => [words, count(grades)]).filter(([, names]) => names.length)
    .map(([words, names]) => `${words}: ${names.join(", ")}`);
  const changed = joints.filter(j => j.change && j.change.state === "standing").map(j => j.joint);
  if (changed.length) parts.push(`changed: ${[...new Set(changed)].join(", ")}`);
  const good = joints.filter(j => j.grade === "good" && !changed.includes(j.joint)).length;
  if (good) parts.push(`${good} of ${joints.length} good`);
  return parts.join("; ") || `${joints.length} joint${joints.length > 1 ? "s" : ""}, no limits set`;
}

function show(state) {
  heard = performance.now();
  lastTime = state.time;
  const keys = new Set(state.joints.map(j => `${j.node}\n${j.joint}`));
  for (const [key, made] of cards)
    if (!keys.has(key)) {
      made.section.remove();
      cards.delete(key);
    }
  for (const joint of state.joints) draw(joint);
  put(document.getElementById("summary"), summary(state.joints));
  link(state.master ? "" : "The ROS master does not answer: what is shown may be old.", !state.master);
  document.body.classList.remove("lost-page");
}

function link(text, lost) {
  const line = document.getElementById("link");
  put(line, text || `live, ${clock(lastTime)}`);
  line.classList.toggle("lost", lost);
}

function look() {
  if (performance.now() - heard < 1000 * SILENT) return;
  document.body.classList.add("lost-page");
  link(lastTime === null ? "The server of this page does not answer." :
    `The server of this page is lost: what is shown is of ${moment(lastTime)}.`, true);
}

let events = null;
function listen() {
  if (events !== null && events.readyState !== EventSource.CLOSED) return;  // else it tries again by itself
  events = new EventSource("events");
  events.onmessage = event => show(JSON.parse(event.data));
}
listen();
setInterval(look, 500);
setInterval(listen, 3000);
