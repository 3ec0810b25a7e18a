#include "engine/debrief/page_text.h"

namespace debrief {

// clang-format off
const char* const page_style = R"style(
:root{--ink:#1b1f24;--soft:#5b636d;--rule:#dcdfe3;--good:#00795c;--bad:#b4003c;--accent:#0072b2}
*{box-sizing:border-box}
body{font:15px/1.5 system-ui,"Segoe UI","DejaVu Sans",sans-serif;color:var(--ink);background:#fff;
  max-width:1080px;margin:0 auto;padding:28px 24px 60px}
h1{font-size:25px;line-height:1.2;margin:0 0 4px}
h2{font-size:18px;margin:34px 0 8px;border-bottom:1px solid var(--rule);padding-bottom:4px}
.about{color:var(--soft);margin:0}
.verdict{display:flex;gap:28px;align-items:baseline;flex-wrap:wrap;margin:18px 0 0}
.points{font-size:46px;font-weight:700;line-height:1}
.points small{font-size:17px;font-weight:400;color:var(--soft)}
.reached{color:var(--good);font-weight:600}
.missed{color:var(--bad);font-weight:600}
.note{background:#fff6e0;border-left:4px solid #e69f00;padding:6px 12px;margin:10px 0}
table{border-collapse:collapse;width:100%}
th,td{padding:4px 10px;text-align:right;border-bottom:1px solid var(--rule)}
th:first-child,td:first-child{text-align:left}
thead th{color:var(--soft);font-weight:600;border-bottom:2px solid var(--rule)}
td.worse,td.costs{color:#7a4a00;font-weight:600}
td.worse::before{content:"! "}
td.better{color:var(--good)}
td.better::before{content:"\2713  "}
dt{font-weight:600;margin-top:8px}
dd{margin:0 0 0 18px}
details{margin:8px 0}
summary{cursor:pointer;color:var(--accent)}
table.treatment td{white-space:nowrap}
table.treatment td.what{white-space:normal;text-align:left;color:var(--soft);font-size:13px;width:45%}
tr.group th{padding-top:14px;text-align:left;color:var(--accent)}
svg{display:block;width:100%;height:auto;font-family:inherit}
.tick{font-size:11px;fill:#666}
.lane{font-size:12px;fill:#333;font-weight:600}
#time{cursor:crosshair}
.mark text{font-weight:700}
#cursor,.here{visibility:hidden}
.live #cursor,.live .here{visibility:visible}
#moment{min-height:1.5em;color:var(--soft);font-variant-numeric:tabular-nums}
.two{display:flex;gap:28px;align-items:flex-start}
.two section{min-width:0}
.two section:first-child{flex:0 0 auto;width:62%}
.two section:last-child{flex:1}
@media(max-width:800px){.two{display:block}.two section:first-child{width:auto}}
ol.errors{padding-left:0;list-style:none;margin:0}
ol.errors li{padding:5px 8px;border-bottom:1px solid var(--rule)}
ol.errors a{color:inherit;text-decoration:none;display:block}
ol.errors small{display:block;color:var(--soft);padding-left:30px}
ul.advice{padding-left:20px}
ol.errors b{display:inline-block;min-width:22px;text-align:center;background:#b4003c;color:#fff;border-radius:11px;
  margin-right:8px;font-size:13px}
ul.teacher{list-style:none;padding:0;margin:0}
ul.teacher li{padding:4px 8px;border-bottom:1px solid var(--rule)}
ul.teacher li.did{color:var(--soft)}
ul.teacher li[data-frame]{cursor:pointer}
ul.teacher b{display:inline-block;min-width:52px;font-variant-numeric:tabular-nums}
li.chosen,figure.chosen{background:#e9f3fa;outline:2px solid var(--accent)}
.frames{display:grid;grid-template-columns:repeat(auto-fill,minmax(240px,1fr));gap:14px}
figure{margin:0;padding:6px}
figure img{width:100%;display:block;background:#000}
figcaption{font-size:13px;color:var(--soft);padding-top:4px}
.curves{display:grid;grid-template-columns:repeat(auto-fill,minmax(290px,1fr));gap:10px}
.legend{font-size:13px;color:var(--soft)}
.legend i{display:inline-block;width:14px;height:4px;vertical-align:middle;margin:0 4px 0 12px}
@media print{body{max-width:none;padding:0;font-size:11pt}h2{break-after:avoid}
  figure,svg,tr,li{break-inside:avoid}.screen{display:none}}
)style";

const char* const page_script = R"script(
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const time = document.getElementById("time");
const cursor = document.getElementById("cursor");
const moment = document.getElementById("moment");
let at = data.moments.length - 1;

function show(index) {
  if (!data.moments.length) return;
  at = Math.max(0, Math.min(data.moments.length - 1, index));
  const m = data.moments[at];
  const left = +time.dataset.left, right = +time.dataset.right, last = +time.dataset.last;
  document.body.classList.add("live");
  cursor.setAttribute("transform", "translate(" + (left + (right - left) * m[1] / last) + ",0)");
  for (const dot of document.querySelectorAll(".here")) {
    const across = dot.dataset.axis === "x" ? m[2] : m[3];
    dot.setAttribute("cx", (across - dot.dataset.x0) * dot.dataset.k);
    dot.setAttribute("cy", (dot.dataset.top - m[4]) * dot.dataset.k);
  }
  moment.textContent = m[1].toFixed(2) + " s, frame " + m[0] + ": " + m[5].toFixed(0) + " mm inserted, " +
    m[6].toFixed(2) + " N, " + m[7].toFixed(1) + " mm to the target";
}

function indexOf(frame) {
  let best = 0;
  data.moments.forEach((m, i) => { if (m[0] <= frame) best = i; });
  return best;
}

function choose() {
  const found = /^#e([0-9]+)$/.exec(location.hash);
  for (const old of document.querySelectorAll(".chosen")) old.classList.remove("chosen");
  const frame = found ? data.marks[+found[1] - 1] : undefined;
  if (frame === undefined) return;
  show(indexOf(frame));
  const row = document.getElementById("row" + found[1]);
  if (row) row.classList.add("chosen");
  const picture = document.querySelector("figure[data-frame='" + frame + "']");
  if (picture) picture.classList.add("chosen");
}

time.addEventListener("click", event => {
  if (event.target.closest("a")) return;
  const box = time.getBoundingClientRect();
  const x = (event.clientX - box.left) * time.viewBox.baseVal.width / box.width;
  const left = +time.dataset.left, right = +time.dataset.right;
  const seconds = (x - left) / (right - left) * time.dataset.last;
  let best = 0;
  data.moments.forEach((m, i) => {
    if (Math.abs(m[1] - seconds) < Math.abs(data.moments[best][1] - seconds)) best = i;
  });
  show(best);
});
for (const item of document.querySelectorAll("li[data-frame]"))
  item.addEventListener("click", () => show(indexOf(+item.dataset.frame)));
document.addEventListener("keydown", event => {
  const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
  if (!step || event.ctrlKey || event.altKey) return;
  show(at + step);
  event.preventDefault();
});
window.addEventListener("hashchange", choose);
choose();
)script";
// clang-format on

}  // namespace debrief
