// The live page on a simulation in the browser: the demo without a server.
import './simulated_server.js';
import '../../host/serve/web/page/main.js';
