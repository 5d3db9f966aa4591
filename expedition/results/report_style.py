"""Looks and motion of the report: its style sheet and its script."""

from __future__ import annotations

from expedition.results.colours import ROBOTS, ROBOTS_ON_DARK, TASKS, VICTIM


def style_sheet() -> str:
    """Return the style sheet, light and dark."""
    light = [f"--r{i}:{colour}" for i, colour in enumerate(ROBOTS)]
    dark = [f"--r{i}:{colour}" for i, colour in enumerate(ROBOTS_ON_DARK)]
    light += [f"--{kind}:{pair[0]}" for kind, pair in TASKS.items()]
    dark += [f"--{kind}:{pair[1]}" for kind, pair in TASKS.items()]
    light.append(f"--victim:{VICTIM[0]}")
    dark.append(f"--victim:{VICTIM[1]}")
    return (
        f":root{{{';'.join(_LIGHT + light)}}}"
        f"@media(prefers-color-scheme:dark){{:root{{{';'.join(_DARK + dark)}}}"
        ".on-light{display:none}.on-dark{display:inline}}"
        f"{_RULES}"
    )


_LIGHT = [
    "color-scheme:light dark",
    "--page:#f3f4f6",
    "--card:#fff",
    "--ink:#1b2430",
    "--soft:#5d6878",
    "--faint:#dfe3e9",
    "--unknown:#e6e9ee",
    "--accent:#0b6aa8",
    "--good:#12805c",
    "--warn:#a86400",
    "--bad:#c2343b",
    "--halo:#fff",
]
_DARK = [
    "--page:#0e1217",
    "--card:#171c23",
    "--ink:#e7ebf0",
    "--soft:#97a3b2",
    "--faint:#2a313b",
    "--unknown:#10151b",
    "--accent:#5db4ea",
    "--good:#3fc795",
    "--warn:#e5a545",
    "--bad:#f4737a",
    "--halo:#10151b",
]

_RULES = """
.on-dark{display:none}
@media(prefers-color-scheme:dark){.on-dark{display:inline}}
*{box-sizing:border-box}
body{margin:0;background:var(--page);color:var(--ink);
 font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
main{max-width:1200px;margin:0 auto;padding:36px 24px 64px}
header{margin-bottom:22px}
.brand{font-size:12px;letter-spacing:.14em;text-transform:uppercase;color:var(--soft)}
h1{font-size:31px;line-height:1.2;margin:2px 0 8px;font-weight:680;letter-spacing:-.015em}
h2{font-size:16px;margin:0 0 14px;font-weight:650}
h2 small{font-weight:400;color:var(--soft);font-size:13px;margin-left:8px}
.lead{font-size:16.5px;max-width:78ch;margin:10px 0 0}
.chips{display:flex;flex-wrap:wrap;gap:7px;align-items:center}
.chip{border:1px solid var(--faint);background:var(--card);border-radius:99px;padding:2px 11px;
 font-size:13px;color:var(--soft)}
.chip b{color:var(--ink);font-weight:600}
.ended{color:#fff;border:0;font-weight:650}
.ended.good{background:#12805c}.ended.warn{background:#a86400}.ended.bad{background:#c2343b}
.card{background:var(--card);border:1px solid var(--faint);border-radius:14px;padding:20px 22px;
 margin:16px 0;overflow:hidden}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(190px,1fr));gap:12px;margin:20px 0}
.tile{background:var(--card);border:1px solid var(--faint);border-radius:14px;padding:13px 16px}
.tile span{display:block;font-size:12.5px;color:var(--soft)}
.tile strong{display:block;font-size:23px;font-weight:680;letter-spacing:-.01em;line-height:1.35;
 font-variant-numeric:tabular-nums;white-space:nowrap}
.tile em{font-style:normal;font-size:12.5px;color:var(--soft);display:block}
.tile code{font-size:17px}
.meter{height:5px;border-radius:3px;background:var(--faint);margin:4px 0 3px}
.meter i{display:block;height:100%;border-radius:3px;background:var(--good)}
svg{display:block;width:100%;height:auto}
svg text{font-family:inherit;fill:var(--ink);font-variant-numeric:tabular-nums}
svg .soft{fill:var(--soft)}
.map{background:var(--unknown);border-radius:10px}
.halo{paint-order:stroke;stroke:var(--halo);stroke-width:3.5px;stroke-linejoin:round}
.legend{display:flex;flex-wrap:wrap;gap:6px 18px;margin-top:12px;font-size:13px;color:var(--soft);
 align-items:center}
.legend label{cursor:pointer}
.legend svg{display:inline-block;width:26px;height:12px;vertical-align:-1px;margin-right:6px}
.legend .key{white-space:nowrap}
.player{display:flex;gap:12px;align-items:center;margin-top:12px}
.player button{border:1px solid var(--faint);background:none;color:var(--ink);border-radius:8px;
 width:84px;padding:4px 0;font:inherit;font-size:13px;cursor:pointer}
.player button:hover{border-color:var(--accent)}
.player input{flex:1;accent-color:var(--accent);min-width:80px}
.player output{width:9ch;text-align:right;font-variant-numeric:tabular-nums;color:var(--soft);
 font-size:13px}
.scroll{overflow:auto;max-height:430px}
table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}
th{font-weight:500;color:var(--soft);text-align:left;font-size:12.5px;position:sticky;top:0;
 background:var(--card);white-space:nowrap}
th,td{padding:6px 14px 6px 0;border-bottom:1px solid var(--faint)}
tr:last-child td{border-bottom:0}
.num{text-align:right;white-space:nowrap}
td code,.mono{font:12.5px ui-monospace,SFMono-Regular,Menlo,Consolas,monospace}
.dot{display:inline-block;width:10px;height:10px;border-radius:50%;margin-right:8px}
.bar{display:inline-block;height:9px;border-radius:3px;background:var(--accent);opacity:.75;
 min-width:1px}
.barcell{width:32%}
.two{display:grid;grid-template-columns:1fr 1fr;gap:16px;align-items:start}
.two .card{margin:0;min-width:0}
@media(max-width:900px){.two{grid-template-columns:1fr}main{padding:20px 12px}}
details summary{cursor:pointer;font-weight:650}
details.sub{margin-top:14px}details.sub summary{font-weight:500;font-size:13.5px;color:var(--soft)}
pre{overflow:auto;
 font:12.5px/1.55 ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;margin:14px 0 0}
.quiet{color:var(--soft);margin:0}
.notice{border-left:4px solid var(--warn)}
.notice ul{margin:0;padding-left:20px}
.grid{stroke:var(--faint);stroke-width:1}
.failed{color:var(--bad)}
footer{color:var(--soft);font-size:12.5px;margin-top:26px}
.hide-truth .truth{display:none}
@media print{.player{display:none}.card{break-inside:avoid}}
"""

# Moves the robots along their ways as the slider goes; at the right end the page is as it was.
SCRIPT = """
(()=>{const d=JSON.parse(document.getElementById('motion').textContent);
const slider=document.getElementById('t'),out=document.getElementById('clock'),
 play=document.getElementById('play');
const truth=document.getElementById('show-truth'),map=document.getElementById('map');
if(truth)truth.onchange=()=>map.classList.toggle('hide-truth',!truth.checked);
if(!slider)return;
const last=+slider.max,tracks=[...document.querySelectorAll('[data-way]')].map(line=>{
 const end=document.querySelector('[data-end="'+line.dataset.way+'"]');
 return{line,end,whole:line.getAttribute('points'),home:end.getAttribute('transform'),
  way:d.ways[line.dataset.way]}});
const cursors=[...document.querySelectorAll('.cursor')];
const clock=t=>d.unit==='steps'?Math.round(t)+' steps':
 Math.floor(t/60)+':'+String(Math.floor(t%60)).padStart(2,'0');
function show(k){const whole=k>=last;
 for(const r of tracks){if(!r.way.length)continue;
  if(whole){r.line.setAttribute('points',r.whole);r.end.setAttribute('transform',r.home);continue}
  const n=Math.min(k,r.way.length-1),p=r.way[n];
  r.line.setAttribute('points',r.way.slice(0,n+1).map(q=>q[0]/10+','+q[1]/10).join(' '));
  r.end.setAttribute('transform','translate('+p[0]/10+' '+p[1]/10+')')}
 const t=d.end*k/last;out.textContent=clock(t);
 for(const c of cursors){const x=+c.dataset.x0+(+c.dataset.x1-+c.dataset.x0)*k/last;
  c.setAttribute('x1',x);c.setAttribute('x2',x);c.style.display=whole?'none':''}}
let timer=0;const stop=()=>{cancelAnimationFrame(timer);timer=0;play.textContent='\\u25b6 Play'};
slider.oninput=()=>{stop();show(Math.floor(+slider.value))};
play.onclick=()=>{if(timer)return stop();
 if(+slider.value>=last)slider.value=0;play.textContent='\\u23f8 Pause';
 let before=performance.now();const step=now=>{
  const k=+slider.value+(now-before)*last/20000;before=now;
  slider.value=k;show(Math.min(last,Math.floor(k)));
  if(k>=last)return stop();timer=requestAnimationFrame(step)};
 timer=requestAnimationFrame(step)};
show(last)})();
"""
