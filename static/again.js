"use strict";
// Loads the page again after as many seconds as the script element says.
setTimeout(() => location.reload(), 1000 * Number(document.currentScript.dataset.after));
