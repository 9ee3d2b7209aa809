// The zstd streams of SPZ version 4, unpacked by Zig's own library.
const std = @import("std");

pub const panic = std.debug.no_panic;

/// Unpacks frames into `to`; the number of bytes written, more than there is room for, or the largest number if they
/// are damaged.
export fn unpack_zstd(from: [*]const u8, from_size: usize, to: [*]u8, to_size: usize) usize {
    var input: std.Io.Reader = .fixed(from[0..from_size]);
    var output: std.Io.Writer = .fixed(to[0..to_size]);
    var frames: std.compress.zstd.Decompress = .init(&input, &.{}, .{ .window_len = std.math.maxInt(u32) });
    return frames.reader.streamRemaining(&output) catch std.math.maxInt(usize);
}
