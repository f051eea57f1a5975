// Link to a moment of a recording, after the # of the address: recording=NAME&t=SECONDS.
export function linked() {
  const given = new URLSearchParams(location.hash.slice(1));
  const t = Number(given.get('t'));
  return given.get('recording') ? {name: given.get('recording'), t: Number.isFinite(t) ? t : 0} : null;
}

/// t: seconds since the start of the recording; name: null: the link leads to the live page.
export function setLink(name, t = 0) {
  const hash = name === null ? '' : `#${new URLSearchParams({recording: name, t: t.toFixed(3)})}`;
  if (location.hash !== hash) history.replaceState(null, '', location.pathname + location.search + hash);
}
