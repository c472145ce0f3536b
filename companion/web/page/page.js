"use strict";
// The page: shows what comes, says how old it is, and gives two orders that stop the boat.
(() => {
  const $ = (id) => document.getElementById(id);
  const OLD_S = 3, HEARD_MS = 2000, SETTLED_S = 3, SILENT_MS = 8000, FIRST_MS = 20000, ROUNDS = 100000;
  const boat = {};
  let heardAt = null, lastPlan = "", key = null, knownTexts = "";
  const text = (id, value) => { const el = $(id); if (el.textContent !== value) el.textContent = value; };
  // As fine as it is of use, and in one piece: a number and its unit stand in one line.
  const number = (value, unit, digits) => {
    if (value === null || value === undefined) return "–";
    const large = Math.abs(value);
    const [shown, name, places] = unit === "m" && large >= 10000 ? [value / 1000, "km", 1] : [value, unit, large >= 100 ? 0 : digits];
    return `${shown.toFixed(places).replace(/^-(0\.?0*)$/, "$1")}\u00a0${name}`;
  };
  const degrees = (value) => (value === null || value === undefined ? "–" : `${String(Math.round(value) % 360).padStart(3, "0")}°`);
  const clock = (s) => `${Math.floor(s / 3600)}:${String(Math.floor(s / 60) % 60).padStart(2, "0")}:${String(Math.floor(s) % 60).padStart(2, "0")}`;

  function list(id, items, make) {
    const el = $(id), found = JSON.stringify(items);
    if (el.dataset.shown === found) return;
    el.dataset.shown = found;
    el.replaceChildren(...items.map(make));
  }
  function item(words, kind) { const li = document.createElement("li"); li.textContent = words; if (kind) li.className = kind; return li; }

  // A telephone that sleeps stops one of its clocks, and a clock that is set right makes the other leap: the longer time is taken.
  let hides = 0;  // how often the page has gone out of sight, or come back
  const moment = () => ({ steady: performance.now(), wall: Date.now(), hides });
  const sinceMs = (then) => Math.max(performance.now() - then.steady, Date.now() - then.wall);

  // Of an order it is taken only where something may have slept: the page was out of sight, or the boat's own clock went on without this
  // one. A clock that is set right while a person looks on drops no order.
  const sincePressMs = (at, boat_s) => {
    const slept = hides !== at.hides || boat_s - at.boat_s > HEARD_MS / 1000 + OLD_S;
    return slept ? sinceMs(at) : performance.now() - at.steady;
  };

  // ---- what the boat says

  function show() {
    document.title = boat.name ? `${boat.mode}: ${boat.name}` : "Boat";
    text("name", boat.name || "Boat");
    text("mode", boat.mode || "–");
    text("armed", boat.armed ? "ARMED" : "disarmed");
    $("armed").className = boat.armed ? "chip armed" : "chip";
    text("now", boat.now || "Nothing heard yet");
    list("next", boat.next || [], (words) => item(words));
    list("failsafes", boat.failsafes || [], failsafe);
    announce(boat.failsafes || []);
    list("reasons", boat.not_ready || [], (words) => item(words));
    $("unready").hidden = !(boat.not_ready || []).length;
    text("keel", number(boat.keel_m, "m", 1));
    const guard = boat.guard === "off" ? "guard OFF: no shoal stops her" : `guard: ${boat.guard}`;
    const limit = number(boat.keel_limit_m, "m", 1), stop = number(boat.keel_stop_m, "m", 1);
    text("limit", boat.keel_limit_m === null || boat.guard === "off" ? guard : `limit ${limit}${boat.keel_stop_m === null || stop === limit ? "" : ` (stopped at ${stop} now)`}, ${guard}`);
    $("keelbox").className = boat.guard === "ok" || boat.guard === "unknown" ? "wide" : "wide low";
    text("speed", number(boat.speed_mps, "m/s", 1));
    text("knots", boat.speed_mps === null || boat.speed_mps === undefined ? "" : `${(boat.speed_mps * 1.943844).toFixed(1)} kn over ground`);
    text("heading", degrees(boat.heading_deg));
    text("course", degrees(boat.course_deg));
    text("plan", boat.items ? `${boat.at_item}, ${boat.plan}` : "none");
    text("togo", number(boat.to_go_m, "m", 0));
    text("xte", number(boat.cross_track_m, "m", 1));
    text("fence", boat.fence_on ? number(boat.fence_m, "m", 0) : "off");
    text("battery", number(boat.battery_v, "V", 1));
    text("receiver", boat.receiver || "–");
    list("texts", [...(boat.texts || [])].reverse(), message);
    list("links", boat.links || [], link);
    $("traffic").hidden = !boat.others_known;
    list("others", (boat.others || []).length ? boat.others : [null], other);
    place();
    document.body.classList.toggle("orders", Boolean(boat.orders));
    still();
  }

  const head_of = (f) => f.cause + (f.doing && `: ${f.doing}`);
  function failsafe(f) {
    const li = item("", ["", "warning", "taken over"].includes(f.doing) ? "mild" : "");
    const head = document.createElement("b");
    head.textContent = head_of(f);
    li.append(head);
    const clockWords = f.next_in_s === null ? "" : f.runs ? `${f.next} in ${Math.max(0, f.next_in_s).toFixed(0)} s. ` : `The clock of ${f.next} stands at ${f.next_in_s.toFixed(0)} s to go. `;
    if (clockWords || f.until) li.append(`${clockWords}${f.until ? f.until[0].toUpperCase() + f.until.slice(1) + "." : ""}`);
    return li;
  }
  // To who listens: a failsafe that has come, or does something else now, is told; a clock that runs and a distance are not.
  function announce(failsafes) {
    const found = JSON.stringify(failsafes.map((f) => [f.name, f.doing]));
    const el = $("failsafestold"), before = el.dataset.told;
    if (before === found) return;
    el.dataset.told = found;
    text("failsafestold", failsafes.map((f) => `Failsafe: ${head_of(f)}.`).join(" ") || (before ? "No failsafe any more." : ""));
  }
  function message([, t, severity, words]) {
    const li = document.createElement("li"), at = document.createElement("time"), said = document.createElement("span");
    const level = ["EMERGENCY", "ALERT", "CRITICAL", "ERROR"].includes(severity) ? "bad" : severity === "WARNING" ? "mild" : "";
    at.textContent = clock(t);
    said.className = level;
    said.textContent = level ? `${severity.toLowerCase()}: ${words}` : words;
    li.append(at, said);
    return li;
  }
  // Another vessel: what we owe her first, then where she is and goes.
  function other(o) {
    if (!o) return item(`${boat.others_known} known, none near`);
    const li = item("", o.danger === "close" || o.kind === "person in the water" ? "bad" : o.danger === "risk" ? "mild" : ""), head = document.createElement("b");
    head.textContent = o.sentence || o.title;
    const knots = o.speed_mps === undefined ? "speed not said" : `${(o.speed_mps * 1.943844).toFixed(1)} kn`;
    const way = o.at_rest ? "at rest" : o.course_deg === undefined ? knots : `${degrees(o.course_deg)}, ${knots}`;
    const place = o.range_m === undefined ? "" : `${o.range_m.toFixed(0)} m, bearing ${degrees(o.bearing_deg)}; `;
    li.append(head, `${place}${way}; ${o.length_m ? `${o.length_m} m, ` : ""}${o.kind}${o.age_s >= 20 ? `; heard ${o.age_s} s ago` : ""}`);
    return li;
  }
  function link([name, kind, open, age]) {
    const li = document.createElement("li"), head = document.createElement("b"), rest = document.createElement("span");
    head.textContent = name;
    const lost = !open && kind !== "endpoint" && kind !== "plotter";
    rest.className = lost ? "bad" : "";
    rest.textContent = lost ? "MISSING" : !open ? "nobody there" : age === null ? "open, nothing heard" : age === 0 ? "heard now" : `heard ${age} s ago`;
    li.append(head, rest);
    return li;
  }

  function place() {
    const d = Chart.data;
    d.boat = boat.lat_deg === null || boat.lat_deg === undefined ? null : [boat.lat_deg, boat.lon_deg];
    d.heading = boat.heading_deg ?? null;
    d.home = boat.home_deg || null;
    d.target = boat.armed ? boat.target_deg || null : null;
    d.limit = boat.keel_limit_m ?? null;
    d.others = boat.others || [];
    let words = "No position";
    if (d.boat) {
      const last = d.track[d.track.length - 1], m = (a, b) => Math.hypot((b[0] - a[0]) * Chart.M_PER_DEG, (b[1] - a[1]) * Chart.M_PER_DEG * Math.cos(a[0] * Math.PI / 180));
      if (!last || m(last, d.boat) > 2) d.track.push([...d.boat, boat.keel_m]);
      if (d.track.length > 1500) d.track.splice(0, 300);
      words = `${d.boat[0].toFixed(5)}° ${d.boat[1].toFixed(5)}°`;
      if (d.home) {
        const bearing = Math.atan2((d.home[1] - d.boat[1]) * Math.cos(d.boat[0] * Math.PI / 180), d.home[0] - d.boat[0]) * 180 / Math.PI;
        words += `; home ${m(d.boat, d.home).toFixed(0)} m, bearing ${degrees((bearing + 360) % 360)}`;
      }
    }
    text("where", words);
    $("map").setAttribute("aria-label", `Map: boat at ${words}, heading ${degrees(boat.heading_deg)}`);
    text("legend", "Blue line: way sailed. Purple: plan. Green dashes: stay inside. Red: stay out. Triangles: other vessels, with a minute of their way; orange: risk, red: close, or a person in the water. Squares: depth below chart datum" + (d.limit === null ? "." : `, red below ${d.limit.toFixed(1)} m.`));
    Chart.draw();
  }

  function age() {
    const s = (heardAt === null ? Infinity : sinceMs(heardAt) / 1000) + (boat.age_s || 0);
    const old = !(s <= OLD_S) || boat.age_s === null;
    document.body.classList.toggle("old", old);
    const state = heardAt === null ? "connecting …" : boat.age_s === null ? "NO WORD OF THE BOAT" : old ? "OLD" : "live";
    text("live", state === "OLD" ? `OLD: ${s.toFixed(0)} s ago` : state);
    // To who listens only what it means, when that changes: the seconds would be read out for ever, over "NOT HEARD".
    text("livetold", state === "OLD" ? "OLD: the boat is not heard" : state);
    if (stalled()) listen();
  }

  // The boat sends something each second. A connection that went silent is not mended by waiting: what carries it asks ever more seldom,
  // for a minute and longer after the way is back. One that has just been opened on a slow link is let bring its first, whole picture.
  let stream = null, streamAt = null, firstIsDue = false;
  const stalled = () => sinceMs(streamAt) > (firstIsDue ? FIRST_MS : SILENT_MS);

  function listen() {
    if (stream) stream.close();
    const own = stream = new EventSource("/live");
    streamAt = moment();
    firstIsDue = false;
    own.onopen = () => { streamAt = moment(); firstIsDue = true; };
    own.onmessage = (event) => {
      if (stalled()) return listen();  // kept back on the way: what comes first on a new stream is of now
      streamAt = moment();
      firstIsDue = false;
      const told = JSON.parse(event.data);
      if (obeyed && told.t_s < boat.t_s) obeyed.t_s = -Infinity;  // a clock that begins anew: the vessel's program has been started again
      Object.assign(boat, told);
      heardAt = moment();
      if (boat.mode) show();
      age();
      const plan = JSON.stringify(boat.plan_ids);
      if (plan !== lastPlan) { lastPlan = plan; setTimeout(fetchMap, 600); }
    };
    // A server that is gone for long, or has refused, is tried again here; a break is mended by the browser.
    own.onerror = () => { if (own.readyState === EventSource.CLOSED) setTimeout(() => { if (own === stream) listen(); }, 1500); };
  }

  async function fetchMap() {
    try {
      const found = await (await fetch("/map")).json(), track = Chart.unpack(found.track);
      if (track.length >= Chart.data.track.length) Chart.data.track = track;
      Chart.data.legs = found.drawing.legs || [];
      Chart.data.areas = found.drawing.areas || [];
      Chart.draw();
    } catch { setTimeout(fetchMap, 3000); }
  }
  async function fetchDepths() {
    try { Chart.bottom(await (await fetch("/depths")).json()); } catch { /* the next look comes */ }
  }
  async function fetchRuns() {
    try {
      const found = await (await fetch("/runs")).json();
      list("runs", found.length ? found : [null], run);
    } catch { text("runs", "not reached: open again"); }
  }
  function run(found) {
    if (!found) return item("none yet");
    const li = document.createElement("li"), head = document.createElement("b");
    head.textContent = found.name;
    li.append(head, document.createElement("br"));
    for (const [name, size] of found.files) {
      const a = document.createElement("a");
      a.href = `/runs/${encodeURIComponent(found.name)}/${encodeURIComponent(name)}`;
      a.textContent = name === "report.html" ? "Report" : `${name} (${size < 1e6 ? `${Math.ceil(size / 1000)} kB` : `${(size / 1e6).toFixed(1)} MB`})`;
      if (name === "report.html") a.target = "_blank"; else a.download = name;
      li.append(a);
    }
    if (!found.report) li.append("No report yet: companion report on a computer with the run's folder.");
    return li;
  }

  // ---- orders

  // With this tab, also when it is loaded again; a browser may keep nothing.
  function stored(name) { try { return sessionStorage.getItem(name); } catch { return null; } }
  function store(name, value) {
    try { if (value) sessionStorage.setItem(name, value); else sessionStorage.removeItem(name); } catch { /* not kept */ }
  }
  const bytes = (words) => new TextEncoder().encode(words);
  const tag = (purpose, ...parts) => Sha.hex(Sha.hmac(key, bytes([purpose, ...parts].join("\n"))));
  const said = (words, kind) => { text("said", words); $("said").className = kind || ""; };
  // Without credentials, of which the page has none, a browser keeps orders apart from the stream and the map: they wait for none of them.
  const post = async (path, body) => (await fetch(path, { method: "POST", credentials: "omit", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) })).json();

  // Ask, answer, and believe only what proves that the vessel said it. A browser keeps a question until there is a way, for a minute and
  // more: what comes back after NOT HEARD was told, or after another order, orders nothing. The question is not taken back: a browser
  // would give its half-made connection, which asks seldom whether the way is back, to the next order, and that would not be heard either.
  async function send(order, at) {
    const asked = (await post("/challenge", {})).challenge;
    if (!asked || order !== wanted || sincePressMs(at, asked.t_s) > HEARD_MS) return null;
    const response = tag("usv-companion page order 2", asked.vessel, asked.nonce, order, PAGE);
    const found = await post("/order", { order, nonce: asked.nonce, response, page: PAGE });
    if (found.refused) return { refused: found.refused };
    const answer = found.answer;
    if (!answer || answer.tag !== tag("usv-companion page answer 1", asked.vessel, asked.nonce, answer.outcome)) return null;
    return answer;
  }
  // By it the vessel knows which orders came from one hand, and lets no earlier one overtake a later one: nor one of before it was
  // loaded again, which is on its way all the same.
  const PAGE = stored("page") || Sha.hex(crypto.getRandomValues(new Uint8Array(8)));
  store("page", PAGE);
  let newest = 0, wanted = null, obeyed = null;
  async function order(name, words) {
    let late = false;
    // Another order takes the place of what waits; the same one again does not, or who presses fast would never be heard.
    wanted = name;
    const pressed = { ...moment(), boat_s: boat.t_s };
    const number = ++newest;
    obeyed = null;
    const tell = (...told) => { if (number === newest) said(...told); };  // what an earlier order came to hides no later one
    tell(`${words}: sent`);
    const mute = `${words}: NOT HEARD: use the emergency switch`;
    const timer = setTimeout(() => { late = true; tell(mute, "bad"); }, HEARD_MS);
    let found = null;
    try { found = await send(name, pressed); } catch { /* not heard */ }
    clearTimeout(timer);
    const at = new Date(found && found.utc_s ? found.utc_s * 1000 : Date.now()).toLocaleTimeString([], { hour12: false });
    if (found === null) tell(mute, "bad");
    else if (found.refused) tell(`${words}: refused: ${found.refused}`, "bad");
    else if (found.outcome !== "obeyed") tell(`${words}: ${found.outcome}`, "bad");
    else {
      tell(name === "check" ? `${words}: right, orders are ready` : `${words}: obeyed at ${at}${late ? ", late" : ""}`, "good");
      if (number === newest && name !== "check") obeyed = { name, t_s: found.t_s, state: null, armed: boat.armed };
    }
    return found;
  }
  // What an order came to is green while it is so: not when she is armed again, or another's order or a failsafe has changed the mode.
  // By the vessel's own clock: pictures of before, kept back on a bad way, come after the answer and are no news.
  // The mode may take a moment to settle; whether she is armed is no matter of a Hold, and changes by another's order or a failsafe.
  function still() {
    if (!obeyed) return;
    if (boat.t_s <= obeyed.t_s) { obeyed.armed = boat.armed; return; }
    const state = `${boat.armed ? "ARMED" : "disarmed"}, ${boat.mode}`;
    const turned = obeyed.name === "hold" && boat.armed !== obeyed.armed;
    const so = obeyed.name === "hold" ? boat.mode === "Hold" && !turned : !boat.armed;
    const settled = boat.t_s - obeyed.t_s > SETTLED_S;
    if (so && (!settled || obeyed.state === null)) obeyed.state = state;
    else if ((turned || settled || obeyed.state !== null) && state !== obeyed.state) {
      said(`${$("said").textContent}; then ${state}`, "past");
      obeyed = null;
    }
  }

  function keep(found) {
    key = found;
    document.body.classList.toggle("keyed", key !== null);
    store("key", key && Sha.hex(key));
  }
  $("keyform").onsubmit = (event) => {
    event.preventDefault();
    const phrase = $("key").value.trim();
    $("key").value = "";
    if (!phrase) return;
    said("Working on the key …");
    Sha.pbkdf2(bytes(phrase), bytes("usv-companion page"), ROUNDS, async (made) => {
      keep(made);
      const found = await order("check", "Key");
      // Any other refusal says nothing of the key: an order went past the check, or the boat has been started again.
      if (found && found.refused === "wrong key" && key === made) keep(null);
    });
  };
  $("forget").onclick = () => { keep(null); said(""); };
  $("hold").onclick = () => order("hold", "Hold");
  // Wherever a finger comes down the browser puts the slide: only one that came down on the block moves it. Keys and a screen reader
  // go by steps, which stay: no key that jumps, or that is held down, takes it to the end; left alone it goes back.
  const slide = $("disarm"), BLOCK_PX = 70, LEAP = 20, LEFT_ALONE_MS = 30000;
  const HOW = "Disarm: slide the red block to the end; by keys or a screen reader step by step";
  let held = false, slid = false, at = 0, leaving = 0;
  const let_go = () => { held = false; at = 0; slide.value = 0; };
  slide.onpointerdown = (event) => { held = true; slid = event.clientX - slide.getBoundingClientRect().left <= BLOCK_PX; };
  slide.onpointerup = () => setTimeout(() => { if (held) let_go(); });  // after what the browser makes of it
  slide.onpointercancel = let_go;
  slide.onblur = let_go;
  slide.onkeydown = (event) => { held = false; if (event.repeat && event.key !== "Tab") event.preventDefault(); };
  slide.oninput = () => {
    clearTimeout(leaving);
    leaving = setTimeout(let_go, LEFT_ALONE_MS);
    const leaps = !held && Number(slide.value) - at > LEAP;
    if (leaps) said(HOW, "bad");
    if (leaps || (held && !slid)) slide.value = at;
    at = Number(slide.value);
  };
  slide.onclick = () => { if (!slid) said(HOW, "bad"); };
  slide.onchange = () => {
    const whole = at >= 98;
    if (held || whole) let_go();
    if (whole) order("disarm", "Disarm");
  };

  const kept = stored("key");
  if (kept) keep(Sha.unhex(kept));
  $("rundetails").ontoggle = () => { if ($("rundetails").open) fetchRuns(); };
  listen();
  fetchDepths();
  setTimeout(fetchDepths, 20000);
  setInterval(fetchDepths, 120000);
  setInterval(age, 500);
  document.onvisibilitychange = () => { hides += 1; age(); };  // who takes the telephone out again sees at once how old it is
})();
