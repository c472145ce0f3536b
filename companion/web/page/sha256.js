"use strict";
// SHA-256 (FIPS 180-4), HMAC (RFC 2104) and PBKDF2 (RFC 8018): browsers keep theirs from pages on plain http.
const Sha = (() => {
  const K = new Uint32Array([
  0x428a2f98,0x71374491,0xb5c0fbcf,0xe9b5dba5,0x3956c25b,0x59f111f1,0x923f82a4,0xab1c5ed5,
  0xd807aa98,0x12835b01,0x243185be,0x550c7dc3,0x72be5d74,0x80deb1fe,0x9bdc06a7,0xc19bf174,
  0xe49b69c1,0xefbe4786,0x0fc19dc6,0x240ca1cc,0x2de92c6f,0x4a7484aa,0x5cb0a9dc,0x76f988da,
  0x983e5152,0xa831c66d,0xb00327c8,0xbf597fc7,0xc6e00bf3,0xd5a79147,0x06ca6351,0x14292967,
  0x27b70a85,0x2e1b2138,0x4d2c6dfc,0x53380d13,0x650a7354,0x766a0abb,0x81c2c92e,0x92722c85,
  0xa2bfe8a1,0xa81a664b,0xc24b8b70,0xc76c51a3,0xd192e819,0xd6990624,0xf40e3585,0x106aa070,
  0x19a4c116,0x1e376c08,0x2748774c,0x34b0bcb5,0x391c0cb3,0x4ed8aa4a,0x5b9cca4f,0x682e6ff3,
  0x748f82ee,0x78a5636f,0x84c87814,0x8cc70208,0x90befffa,0xa4506ceb,0xbef9a3f7,0xc67178f2]);
  const START = new Uint32Array([
  0x6a09e667,0xbb67ae85,0x3c6ef372,0xa54ff53a,0x510e527f,0x9b05688c,0x1f83d9ab,0x5be0cd19]);
  const w = new Uint32Array(64);

  function compress(state, block) {
    for (let i = 0; i < 16; i++) w[i] = block[i];
    for (let i = 16; i < 64; i++) {
      const x = w[i - 15], y = w[i - 2];
      const s0 = ((x >>> 7) | (x << 25)) ^ ((x >>> 18) | (x << 14)) ^ (x >>> 3);
      const s1 = ((y >>> 17) | (y << 15)) ^ ((y >>> 19) | (y << 13)) ^ (y >>> 10);
      w[i] = w[i - 16] + s0 + w[i - 7] + s1;
    }
    let a = state[0], b = state[1], c = state[2], d = state[3], e = state[4], f = state[5], g = state[6], h = state[7];
    for (let i = 0; i < 64; i++) {
      const s1 = ((e >>> 6) | (e << 26)) ^ ((e >>> 11) | (e << 21)) ^ ((e >>> 25) | (e << 7));
      const t1 = (h + s1 + ((e & f) ^ (~e & g)) + K[i] + w[i]) | 0;
      const s0 = ((a >>> 2) | (a << 30)) ^ ((a >>> 13) | (a << 19)) ^ ((a >>> 22) | (a << 10));
      const t2 = (s0 + ((a & b) ^ (a & c) ^ (b & c))) | 0;
      h = g; g = f; f = e; e = (d + t1) | 0; d = c; c = b; b = a; a = (t1 + t2) | 0;
    }
    state[0] += a; state[1] += b; state[2] += c; state[3] += d; state[4] += e; state[5] += f; state[6] += g; state[7] += h;
    return state;
  }

  // The hash of bytes that follow `before` bytes (whole blocks) already in `state`.
  function finish(state, bytes, before) {
    const padded = new Uint8Array(((bytes.length + 8) >> 6 << 6) + 64);
    padded.set(bytes);
    padded[bytes.length] = 0x80;
    const view = new DataView(padded.buffer), bits = (before + bytes.length) * 8;
    view.setUint32(padded.length - 8, Math.floor(bits / 4294967296));
    view.setUint32(padded.length - 4, bits >>> 0);
    const block = new Uint32Array(16);
    for (let at = 0; at < padded.length; at += 64) {
      for (let i = 0; i < 16; i++) block[i] = view.getUint32(at + 4 * i);
      compress(state, block);
    }
    return state;
  }

  function bytesOf(state) {
    const view = new DataView(new ArrayBuffer(32));
    state.forEach((word, i) => view.setUint32(4 * i, word));
    return new Uint8Array(view.buffer);
  }

  const digest = (bytes) => bytesOf(finish(START.slice(), bytes, 0));

  // The two states from which every tag of a key begins.
  function pads(key) {
    const short = key.length > 64 ? digest(key) : key;
    return [0x36, 0x5c].map((pad) => {
      const words = new Uint32Array(16);
      for (let i = 0; i < 64; i++) words[i >> 2] |= ((short[i] || 0) ^ pad) << (24 - 8 * (i & 3));
      return compress(START.slice(), words);
    });
  }

  function hmac(key, bytes) {
    const [inner, outer] = pads(key);
    return bytesOf(finish(outer, bytesOf(finish(inner, bytes, 64)), 64));
  }

  // One block of PBKDF2, in slices so that the page stays alive; calls done(bytes).
  function pbkdf2(phrase, salt, rounds, done) {
    const [inner, outer] = pads(phrase);
    const first = new Uint8Array(salt.length + 4);
    first.set(salt);
    first[salt.length + 3] = 1;
    const u = finish(outer.slice(), bytesOf(finish(inner.slice(), first, 64)), 64), sum = u.slice();
    const block = new Uint32Array(16);
    block[8] = 0x80000000;
    block[15] = 96 * 8;
    const state = new Uint32Array(8);
    let left = rounds - 1;
    (function slice() {
      for (let n = 0; n < 4000 && left > 0; n++, left--) {
        block.set(u);
        state.set(inner);
        block.set(compress(state, block));
        u.set(outer);
        compress(u, block);
        for (let i = 0; i < 8; i++) sum[i] ^= u[i];
      }
      if (left > 0) setTimeout(slice, 0); else done(bytesOf(sum));
    })();
  }

  const hex = (bytes) => Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  const unhex = (text) => Uint8Array.from(text.match(/../g) || [], (pair) => parseInt(pair, 16));
  return { digest, hmac, pbkdf2, hex, unhex };
})();
