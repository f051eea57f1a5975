// The token for controls: it comes behind the # of the link, is kept for this tab, and does not stay in the address bar.
const kKey = 'token';

function adopt() {
  const given = new URLSearchParams(location.hash.slice(1)).get(kKey);
  if (!given) return;
  sessionStorage.setItem(kKey, given);
  history.replaceState(null, '', location.pathname + location.search);
}

/// Null if there is none.
export const token = () => sessionStorage.getItem(kKey);

adopt();
addEventListener('hashchange', adopt);
