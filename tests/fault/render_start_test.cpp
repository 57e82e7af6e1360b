#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include "embree_image.h"
#include "errors.h"
#include "expect_error.h"

namespace {

enum class Refused { nothing, device, geometry };
Refused refused = Refused::nothing;

template <class Function>
Function* next(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// These stand before Embree's own.
extern "C" {

RTCDevice rtcNewDevice(const char* config) {
  static const auto of_embree = next(&rtcNewDevice, "rtcNewDevice");
  return refused == Refused::device ? nullptr : of_embree(config);
}

RTCGeometry rtcNewGeometry(RTCDevice device, RTCGeometryType type) {
  static const auto of_embree = next(&rtcNewGeometry, "rtcNewGeometry");
  return of_embree(device, refused == Refused::geometry ? RTCGeometryType(1000) : type);
}
}

namespace anticrack {
namespace {

/// What a scene of one sphere says where Embree refuses this.
std::string message_where(Refused what) {
  refused = what;
  const std::string message = message_of<InputError>([] { EmbreeScene(SphereCloud{{{0, 0, 0}}, {0}, 1}); });
  refused = Refused::nothing;
  return message;
}

TEST(Embree, ThatDoesNotStartIsAnErrorThatSaysSo) {
  EXPECT_EQ(message_where(Refused::device), "Embree could not start on this processor");
}

TEST(Embree, RefusesInItsOwnWordsAndWorksAfterwards) {
  EXPECT_EQ(message_where(Refused::geometry), "Embree: invalid geometry type");
  EXPECT_EQ(message_where(Refused::nothing), "(nothing was thrown)");
}

}  // namespace
}  // namespace anticrack
