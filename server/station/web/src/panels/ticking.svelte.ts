/** A counter that increments each second while a component is mounted: for values that the page extrapolates between
 * two messages. */
export function secondsTick(every_ms = 1000): { readonly count: number } {
  let count = $state(0);
  $effect(() => {
    const timer = setInterval(() => { ++count; }, every_ms);
    return () => clearInterval(timer);
  });
  return { get count() { return count; } };
}
