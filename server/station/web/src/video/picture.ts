/** Decodes frames: H.264 by WebCodecs, JPEG by the browser's own decoder. Each is displayed as soon as it is
 * decoded, without a queue. */
import type { Frame } from "./frame";

export type Show = (picture: VideoFrame | ImageBitmap, frame: Frame) => void;

/** Constrained baseline up to level 4.0, Annex B: the output of the server's encoder. */
const h264: VideoDecoderConfig = { codec: "avc1.42E028", optimizeForLatency: true };

export async function canDecodeH264(): Promise<boolean> {
  if (!("VideoDecoder" in globalThis)) return false;  // not available with plain HTTP except on localhost
  try {
    return (await VideoDecoder.isConfigSupported(h264)).supported ?? false;
  } catch {
    return false;
  }
}

export interface PictureDecoder {
  decode(frame: Frame): void;
  close(): void;
}

/** `lost`: a key frame is needed; `failed` : this browser cannot decode. */
export function h264Decoder(show: Show, lost: () => void, failed: (why: string) => void): PictureDecoder {
  const waiting = new Map<number, Frame>();
  let needsKey = true, failures = 0;
  let decoder: VideoDecoder | undefined;
  const open = (): VideoDecoder => {
    const made = new VideoDecoder({
      output: (picture) => {
        const frame = waiting.get(picture.timestamp);
        waiting.delete(picture.timestamp);
        failures = 0;
        if (frame) show(picture, frame);
        else picture.close();
      },
      error: (error) => {
        needsKey = true;
        waiting.clear();
        decoder = undefined;
        if (++failures > 2) failed(error.message);
        else lost();
      },
    });
    made.configure(h264);
    return made;
  };
  return {
    decode(frame) {
      if (needsKey && !frame.key) return;
      needsKey = false;
      decoder ??= open();
      waiting.set(frame.sequence, frame);
      // The sequence number serves as the timestamp: it identifies the frame and increases strictly.
      decoder.decode(new EncodedVideoChunk({ type: frame.key ? "key" : "delta", timestamp: frame.sequence, data: frame.bytes }));
    },
    close() {
      if (decoder && decoder.state !== "closed") decoder.close();
      decoder = undefined;
      waiting.clear();
    },
  };
}

/** The newest frame waits while one is decoded; those between are dropped. */
export function jpegDecoder(show: Show, failed: (why: string) => void): PictureDecoder {
  let busy = false, closed = false;
  let next: Frame | undefined;
  const run = async (first: Frame): Promise<void> => {
    busy = true;
    for (let frame: Frame | undefined = first; frame && !closed; frame = next) {
      next = undefined;
      try {
        const picture = await createImageBitmap(new Blob([frame.bytes as BlobPart], { type: "image/jpeg" }));
        if (closed) picture.close();
        else show(picture, frame);
      } catch (error) {
        failed(String(error));
      }
      if (next === frame) next = undefined;
    }
    busy = false;
  };
  return {
    decode(frame) {
      if (busy) next = frame;
      else void run(frame);
    },
    close() {
      closed = true;
    },
  };
}
