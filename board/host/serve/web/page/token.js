// Token for controls. It comes after the # of the link, is stored for this tab and removed from the address bar.
const kKey = 'token';

function adopt() {
  const given = new URLSearchParams(location.hash.slice(1)).get(kKey);
  if (!given) return;
  sessionStorage.setItem(kKey, given);
  history.replaceState(null, '', location.pathname + location.search);
}

/// Returns null without a token.
export const token = () => sessionStorage.getItem(kKey);

adopt();
addEventListener('hashchange', adopt);
