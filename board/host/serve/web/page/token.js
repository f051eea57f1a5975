// Token for controls. It comes after the # of the link, is stored for this tab and removed from the address bar.
const kKey = 'token';

function adopt() {
  const fields = new URLSearchParams(location.hash.slice(1));
  const given = fields.get(kKey);
  if (!given) return;
  sessionStorage.setItem(kKey, given);
  fields.delete(kKey);
  history.replaceState(null, '', location.pathname + location.search + (String(fields) && `#${fields}`));
}

/// Returns null without a token.
export const token = () => sessionStorage.getItem(kKey);

adopt();
addEventListener('hashchange', adopt);
