function r(t,e){const n=t.toFixed(e);return Number(n)===0?0 .toFixed(e):n}function o(t){const e=Number(r(t*180/Math.PI,0))%360;return`${e<=-180?e+360:e>180?e-360:e}°`}export{r as f,o as h};
