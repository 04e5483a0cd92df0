/** A count that goes up each second while a component shows it: for what the page's clock carries on between two messages. */
export function secondsTick(every_ms = 1000): { readonly count: number } {
  let count = $state(0);
  $effect(() => {
    const timer = setInterval(() => { ++count; }, every_ms);
    return () => clearInterval(timer);
  });
  return { get count() { return count; } };
}
