"use strict";
// The map: a plane about the boat, in metres, drawn on a canvas. What it shows is also said in words below it.
const Chart = (() => {
  const M_PER_DEG = 111195;
  const canvas = document.getElementById("map"), ctx = canvas.getContext("2d");
  const data = { track: [], legs: [], areas: [], sounded: null, charted: null, boat: null, heading: null, others: [], home: null, target: null, limit: null };
  const view = { lat: 0, lon: 0, scale: 2, follow: true, fit: false, known: false };

  function unpack(packed) {
    if (!packed || !packed.origin) return [];
    const [lat, lon] = packed.origin, p = packed.points, found = [];
    for (let i = 0; i < p.length; i += 3) found.push([lat + p[i] * 1e-6, lon + p[i + 1] * 1e-6, p[i + 2] < 0 ? null : p[i + 2] / 10]);
    return found;
  }

  const narrow = () => Math.max(Math.cos(view.lat * Math.PI / 180), 0.01);
  const x = (lon) => canvas.width / 2 + (lon - view.lon) * M_PER_DEG * narrow() * view.scale;
  const y = (lat) => canvas.height / 2 - (lat - view.lat) * M_PER_DEG * view.scale;

  // Red and orange where it is too shallow, then from light to dark blue.
  function water(depth, limit) {
    if (limit !== null && depth < limit) return "#d9534f";
    if (limit !== null && depth < limit + 1) return "#f0ad4e";
    const share = Math.min(1, depth / 25);
    return `hsl(205 60% ${82 - 40 * share}%)`;
  }

  function line(points, close) {
    ctx.beginPath();
    points.forEach((p, i) => (i ? ctx.lineTo(x(p[1]), y(p[0])) : ctx.moveTo(x(p[1]), y(p[0]))));
    if (close) ctx.closePath();
  }

  function cells(found, size) {
    const side = Math.max(2, size * view.scale);
    for (const [lat, lon, depth] of found) {
      if (depth === null) continue;
      ctx.fillStyle = water(depth, data.limit);
      ctx.fillRect(x(lon) - side / 2, y(lat) - side / 2, side, side);
    }
  }

  function sign(place, draw) {
    ctx.save();
    ctx.translate(x(place[1]), y(place[0]));
    draw();
    ctx.restore();
  }

  function boat() {
    sign(data.boat, () => {
      const u = unit();
      if (data.heading === null) {
        ctx.beginPath(); ctx.arc(0, 0, 7 * u, 0, 7);
      } else {
        ctx.rotate(data.heading * Math.PI / 180);
        ctx.beginPath(); ctx.moveTo(0, -15 * u); ctx.lineTo(9 * u, 11 * u); ctx.lineTo(0, 6 * u); ctx.lineTo(-9 * u, 11 * u); ctx.closePath();
      }
      ctx.fillStyle = "#14181d"; ctx.strokeStyle = "#fff"; ctx.lineWidth = 2.5 * u; ctx.fill(); ctx.stroke();
    });
  }

  const PERSON = "person in the water";
  const DANGER = { close: "#a8071a", risk: "#d46b08" };

  // Another vessel: a triangle that points where she goes, a line as long as a minute of her way; a disc at rest.
  function vessel(other) {
    const colour = DANGER[other.danger] || (other.kind === PERSON ? "#a8071a" : "#3d4650"), u = unit();
    const known = other.course_deg !== undefined && !other.at_rest, way = other.course_deg * Math.PI / 180;
    sign(other.at, () => {
      ctx.fillStyle = colour; ctx.strokeStyle = colour; ctx.lineWidth = 2 * u;
      if (known) {
        const length = (other.speed_mps || 0) * 60 * view.scale;
        ctx.beginPath(); ctx.moveTo(0, 0); ctx.lineTo(length * Math.sin(way), -length * Math.cos(way)); ctx.stroke();
        ctx.rotate(way);
        ctx.beginPath(); ctx.moveTo(0, -11 * u); ctx.lineTo(6 * u, 8 * u); ctx.lineTo(-6 * u, 8 * u); ctx.closePath();
      } else { ctx.beginPath(); ctx.arc(0, 0, 6 * u, 0, 7); }
      ctx.fill(); ctx.strokeStyle = "#fff"; ctx.lineWidth = 1.5 * u; ctx.stroke();
    });
    label(other.kind === PERSON ? "PERSON" : other.title, x(other.at[1]) + 9 * u, y(other.at[0]) + 16 * u);
  }

  const unit = () => window.devicePixelRatio || 1;

  function label(text, left, top, align) {
    ctx.font = `600 ${13 * unit()}px system-ui,sans-serif`;
    ctx.textAlign = align || "left";
    ctx.lineWidth = 4 * unit(); ctx.strokeStyle = "#fff"; ctx.strokeText(text, left, top);
    ctx.fillStyle = "#14181d"; ctx.fillText(text, left, top);
  }

  function scaleBar() {
    const u = unit(), most = canvas.width / 3 / view.scale;
    const round = Math.pow(10, Math.floor(Math.log10(most)));
    const length = [5, 2, 1].map((n) => n * round).find((n) => n <= most) || round;
    const px = length * view.scale, left = 12 * u, low = canvas.height - 14 * u;
    ctx.strokeStyle = "#14181d"; ctx.lineWidth = 3 * u;
    ctx.beginPath(); ctx.moveTo(left, low - 6 * u); ctx.lineTo(left, low); ctx.lineTo(left + px, low); ctx.lineTo(left + px, low - 6 * u); ctx.stroke();
    label(length >= 1000 ? `${length / 1000} km` : `${length} m`, left + 6 * u, low - 9 * u);
    label("N ↑", canvas.width - 12 * u, 22 * u, "right");
  }

  function everything() {
    const all = [...data.track.slice(-400), ...data.legs.flatMap((leg) => leg.line), ...data.areas.flatMap((area) => area.line || [area.centre])];
    if (data.boat) all.push(data.boat);
    if (data.home) all.push(data.home);
    for (const other of data.others) if (other.danger !== "none" || other.kind === PERSON) all.push(other.at);
    if (!all.length) return;
    const lats = all.map((p) => p[0]), lons = all.map((p) => p[1]);
    const low = Math.min(...lats), high = Math.max(...lats), west = Math.min(...lons), east = Math.max(...lons);
    view.lat = (low + high) / 2; view.lon = (west + east) / 2;
    const wide = Math.max((east - west) * narrow(), 1e-4) * M_PER_DEG, tall = Math.max(high - low, 1e-4) * M_PER_DEG;
    view.scale = 0.85 * Math.min(canvas.width / wide, canvas.height / tall);
  }

  function draw() {
    const u = unit(), box = canvas.getBoundingClientRect();
    const width = Math.round(box.width * u), height = Math.round(box.height * u);
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    ctx.fillStyle = "#e8f1f8"; ctx.fillRect(0, 0, width, height);
    if (view.fit) everything(); else if (view.follow && data.boat) [view.lat, view.lon] = data.boat;
    if (data.charted) cells(data.charted.cells, data.charted.size);
    if (data.sounded) cells(data.sounded.cells, data.sounded.size);
    for (const area of data.areas) {
      if (area.line) line(area.line, true);
      else { ctx.beginPath(); ctx.arc(x(area.centre[1]), y(area.centre[0]), area.radius_m * view.scale, 0, 7); }
      if (!area.inside) { ctx.fillStyle = "#a8071a33"; ctx.fill(); }
      ctx.strokeStyle = area.inside ? "#0b6b2e" : "#a8071a"; ctx.lineWidth = 2.5 * u; ctx.setLineDash([9 * u, 6 * u]); ctx.stroke();
    }
    ctx.setLineDash([]);
    for (const leg of data.legs) { line(leg.line); ctx.strokeStyle = "#6f2dbd"; ctx.lineWidth = 2.5 * u; ctx.stroke(); }
    ctx.lineJoin = "round";
    line(data.track); ctx.strokeStyle = "#fff"; ctx.lineWidth = 5 * u; ctx.stroke();
    line(data.track); ctx.strokeStyle = "#0b4f9e"; ctx.lineWidth = 2.5 * u; ctx.stroke();
    if (data.home) sign(data.home, () => { ctx.beginPath(); ctx.arc(0, 0, 9 * u, 0, 7); ctx.fillStyle = "#0b6b2e"; ctx.fill(); ctx.font = `700 ${12 * u}px system-ui,sans-serif`; ctx.textAlign = "center"; ctx.fillStyle = "#fff"; ctx.fillText("H", 0, 4.5 * u); });
    if (data.target) sign(data.target, () => { ctx.strokeStyle = "#6f2dbd"; ctx.lineWidth = 3 * u; ctx.beginPath(); ctx.moveTo(-7 * u, -7 * u); ctx.lineTo(7 * u, 7 * u); ctx.moveTo(7 * u, -7 * u); ctx.lineTo(-7 * u, 7 * u); ctx.stroke(); });
    [...data.others].reverse().forEach(vessel);
    if (data.boat) boat();
    scaleBar();
  }

  function zoom(factor) { view.fit = false; view.scale = Math.min(60, Math.max(0.005, view.scale * factor)); pressed(); draw(); }
  function pan(dx, dy) {
    view.fit = view.follow = false;
    view.lon -= dx / (M_PER_DEG * narrow() * view.scale); view.lat += dy / (M_PER_DEG * view.scale);
    pressed(); draw();
  }
  function pressed() {
    document.getElementById("follow").setAttribute("aria-pressed", String(view.follow && !view.fit));
    document.getElementById("all").setAttribute("aria-pressed", String(view.fit));
  }

  const fingers = new Map();
  canvas.addEventListener("pointerdown", (e) => { fingers.set(e.pointerId, e); canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    if (fingers.size === 2) {
      const other = [...fingers.values()].find((f) => f.pointerId !== e.pointerId);
      const span = (f) => Math.hypot(f.clientX - other.clientX, f.clientY - other.clientY);
      zoom(Math.max(span(e), 1) / Math.max(span(before), 1));
    } else pan((e.clientX - before.clientX) * unit(), (e.clientY - before.clientY) * unit());
    fingers.set(e.pointerId, e);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("keydown", (e) => {
    const step = 60 * unit();
    const act = { ArrowLeft: () => pan(step, 0), ArrowRight: () => pan(-step, 0), ArrowUp: () => pan(0, step), ArrowDown: () => pan(0, -step), "+": () => zoom(1.5), "-": () => zoom(1 / 1.5) }[e.key];
    if (act) { e.preventDefault(); act(); }
  });
  document.getElementById("closer").onclick = () => zoom(1.5);
  document.getElementById("wider").onclick = () => zoom(1 / 1.5);
  document.getElementById("follow").onclick = () => { view.follow = true; view.fit = false; pressed(); draw(); };
  document.getElementById("all").onclick = () => { view.fit = true; pressed(); draw(); };
  new ResizeObserver(draw).observe(canvas);

  return {
    data, draw, unpack, M_PER_DEG,
    bottom(found) {
      for (const name of ["sounded", "charted"]) if (found[name]) data[name] = { cells: unpack(found[name]), size: found[name].size_m };
      draw();
    },
  };
})();
