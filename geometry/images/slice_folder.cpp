#include "images/slice_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "images/png_slice.h"
#include "images/tiff_slices.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

bool is_digit(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) != 0;
}

// The digits at the start of `text` without leading zeros; takes them off.
std::string_view take_number(std::string_view& text) {
  std::size_t end = 0, begin = 0;
  while (end < text.size() && is_digit(text[end])) ++end;
  while (begin + 1 < end && text[begin] == '0') ++begin;
  const std::string_view number = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return number;
}

bool is_png(const fs::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  if (ending != ".png" && ending != ".tif" && ending != ".tiff")
    refuse_image(file, "expected a folder that holds slices only (.tif, .tiff, .png)");
  return ending == ".png";
}

Index3 size_of(const fs::path& file) {
  return is_png(file) ? read_png_size(file) : open_tiff(file)->size();
}

class SliceFolder : public SliceReader {
 public:
  explicit SliceFolder(const fs::path& folder) {
    for (const auto& entry : fs::directory_iterator(folder))
      if (!entry.path().filename().string().starts_with('.')) files_.push_back(entry.path());
    if (files_.empty()) refuse_image(folder, "the folder holds no slices (.tif, .tiff, .png)");
    std::ranges::sort(files_, [](const fs::path& a, const fs::path& b) {
      return comes_before(a.filename().string(), b.filename().string());
    });
    if (files_.size() > std::size_t(most_along_an_axis))
      refuse_image(folder, fmt::format("{} slices; expected at most {}", files_.size(), most_along_an_axis));
    for (const fs::path& file : files_) {
      const Index3 size = size_of(file);
      if (size[2] != 1) refuse_image(file, fmt::format("{} pages; expected one slice a file", size[2]));
      if (file == files_.front()) size_ = {size[0], size[1], int(files_.size())};
      if (size[0] != size_[0] || size[1] != size_[1])
        refuse_image(file, fmt::format("{} x {} pixels; expected {} x {} as in {}", size[0], size[1],
                                       size_[0], size_[1], files_.front().filename().string()));
    }
  }

  void read(int k, std::vector<std::uint16_t>& labels) override {
    const fs::path& file = files_[std::size_t(k)];
    is_png(file) ? read_png(file, labels) : open_tiff(file)->read(0, labels);
    if (labels.size() != std::size_t(size_[0]) * std::size_t(size_[1]))
      refuse_image(file, "the file has changed meanwhile");
  }

 private:
  std::vector<fs::path> files_;
};

}  // namespace

bool comes_before(std::string_view a, std::string_view b) {
  const std::string_view whole_a = a, whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (is_digit(a[0]) && is_digit(b[0])) {
      const std::string_view m = take_number(a), n = take_number(b);
      if (m.size() != n.size()) return m.size() < n.size();
      if (m != n) return m < n;
    } else {
      if (a[0] != b[0]) return a[0] < b[0];
      a.remove_prefix(1), b.remove_prefix(1);
    }
  }
  return a.size() != b.size() ? a.size() < b.size() : whole_a < whole_b;
}

std::unique_ptr<SliceReader> open_slice_folder(const fs::path& folder) {
  return std::make_unique<SliceFolder>(folder);
}

}  // namespace anticrack
