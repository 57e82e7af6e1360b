#include "images/inflate_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>

#include "images/slice_reader.h"

namespace anticrack {

InflateStream::InflateStream(const std::filesystem::path& file, std::uint64_t offset)
    : file_(file), stream_(file, std::ios::binary), packed_(1 << 14) {
  stream_.seekg(std::streamoff(offset));
  constexpr int either_head = 32;  // gzip or zlib, as the first bytes say
  if (inflateInit2(&state_, MAX_WBITS + either_head) != Z_OK) throw std::bad_alloc();
}

InflateStream::~InflateStream() {
  inflateEnd(&state_);
}

void InflateStream::read(std::uint8_t* to, std::size_t size) {
  state_.next_out = to;
  constexpr std::size_t most = 1u << 30;
  while (size > 0) {
    state_.avail_out = uInt(std::min(size, most));
    const std::size_t asked = state_.avail_out;
    if (state_.avail_in == 0) {
      stream_.read(reinterpret_cast<char*>(packed_.data()), std::streamsize(packed_.size()));
      state_.next_in = packed_.data();
      state_.avail_in = uInt(stream_.gcount());
      if (state_.avail_in == 0) refuse_image(file_, "the compressed data end early");
    }
    const int outcome = inflate(&state_, Z_NO_FLUSH);
    size -= asked - state_.avail_out;
    if (outcome == Z_STREAM_END) {
      if (size > 0 && inflateReset(&state_) != Z_OK) throw std::bad_alloc();  // gzip files may be joined
    } else if (outcome != Z_OK && outcome != Z_BUF_ERROR) {
      refuse_image(file_,
                   fmt::format("the compressed data are damaged ({})", state_.msg ? state_.msg : "zlib"));
    }
  }
}

void InflateStream::skip(std::uint64_t size) {
  std::vector<std::uint8_t> unused(1 << 16);
  while (size > 0) {
    const std::size_t part = std::min<std::uint64_t>(size, unused.size());
    read(unused.data(), part);
    size -= part;
  }
}

}  // namespace anticrack
