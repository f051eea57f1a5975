// Requests to the server, and the permission for them.
import {server} from './server.js';
import {page} from './state.js';
import {token} from './token.js';

const element = id => document.getElementById(id);
const kAnswerMs = 7000;
const kNeedControls = ['run', 'set', 'record', 'button', 'hemisphere'];
const kHowTo = 'read only; for controls, open the link with the token (printed by tricoil serve, or in its --token-file)';

export function headers() { return token() ? {Authorization: `Bearer ${token()}`} : {}; }

let fading = null;

/// Shows the result of an action for some seconds.
export function say(text) {
  const answer = element('answer');
  answer.textContent = text;
  answer.dataset.fresh = 'true';
  clearTimeout(fading);
  fading = setTimeout(() => {
    answer.dataset.fresh = 'false';
  }, kAnswerMs);
}

/// isQuiet: only a failure is shown. Returns the answer; null: the server is not reachable.
export async function ask(request, isQuiet = false) {
  try {
    const response = await server.request(
        'control', {method: 'POST', headers: {'Content-Type': 'application/json', ...headers()}, body: JSON.stringify(request)});
    const {answer} = await response.json();
    if (!isQuiet || !response.ok) say(answer);
    return answer;
  } catch {
    say('Server not reachable; nothing was changed.');
    return null;
  }
}

/// True if this page may control: controls are open for everyone, or this tab has the token.
export const mayControl = () => page.status.controls === 'open' || (page.status.controls === 'token' && token() !== null);

export function showPermission() {
  const allowed = mayControl();
  for (const id of kNeedControls) element(id).disabled = !allowed;
  const text = allowed || !page.status.controls ? '' : page.status.controls === 'none' ? 'read only' : kHowTo;
  if (element('access').textContent !== text) element('access').textContent = text;
}

/// Shows a dialog; resolves to true if the user agrees.
export function agrees(dialog) {
  dialog.returnValue = '';
  dialog.showModal();
  return new Promise(resolve => dialog.addEventListener('close', () => resolve(dialog.returnValue === 'yes'), {once: true}));
}

/// Switching the coils off affects all users, so the page asks for confirmation.
export async function startOrStop() {
  if (!page.status.running) return ask({run: true});
  const pages = page.status.pages ?? 1;
  element('stop_whom').textContent = pages > 1 ? `everyone, including ${pages} open pages` : 'everyone';
  if (await agrees(element('stop_dialog'))) await ask({run: false});
}

/// Starts a recording, with an optional name, or ends it.
export async function recordOrEnd() {
  if (page.status.recording) return ask({record: false});
  element('record_name').value = '';
  if (await agrees(element('record_dialog'))) await ask({record: true, name: element('record_name').value.trim()});
}
