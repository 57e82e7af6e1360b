#include "io/provenance.h"

#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "files/atomic_file.h"

namespace anticrack {
namespace {

std::string cpu_model() {
  std::ifstream stream("/proc/cpuinfo");
  for (std::string line; std::getline(stream, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

std::string now_utc() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

}  // namespace

std::string_view program_version() {
  return ANTICRACK_VERSION;
}

std::string_view program_commit() {
  return ANTICRACK_COMMIT;
}

std::string provenance_text(std::string_view simd_target, int threads) {
  nlohmann::ordered_json json;
  json["program"] = "anticrack";
  json["version"] = program_version();
  json["commit"] = program_commit();
  json["compiler"] = ANTICRACK_COMPILER;
  json["flags"] = ANTICRACK_FLAGS;
  json["build_type"] = ANTICRACK_BUILD_TYPE;
  json["cpu"] = cpu_model();
  json["simd"] = simd_target;
  json["threads"] = threads;
  json["started_utc"] = now_utc();
  return json.dump(2) + "\n";
}

void write_provenance(const std::filesystem::path& file, std::string_view simd_target, int threads) {
  write_text_atomically(file, provenance_text(simd_target, threads));
}

}  // namespace anticrack
