#include "scene_units.h"

#include <gtest/gtest.h>

namespace anticrack {
namespace {

double value(const char* text, Dimension dimension) {
  return parse_quantity(text, dimension).value.value();
}

TEST(ParseQuantity, ReadsEveryDimensionInItsUnits) {
  EXPECT_EQ(value("10 GPa", Dimension::stress), 10e9);
  EXPECT_EQ(value("2.5 MPa", Dimension::stress), 2.5e6);
  EXPECT_EQ(value("1 m", Dimension::length), 1.0);
  EXPECT_EQ(value("5 mm", Dimension::length), 5e-3);
  EXPECT_EQ(value("2 m/s", Dimension::speed), 2.0);
  EXPECT_EQ(value("5e-4 1/s", Dimension::rate), 5e-4);
  EXPECT_EQ(value("900 kg/m^3", Dimension::density), 900.0);
  EXPECT_EQ(value("0.1 s", Dimension::time), 0.1);
  EXPECT_EQ(value("30 %", Dimension::none), 0.3);
}

TEST(ParseQuantity, RoundsOnceToTheNearestDouble) {
  // Multiplying 5.345 by 1e-6 would give the neighbour of 5.345e-6.
  EXPECT_EQ(value("5.345 um", Dimension::length), 5.345e-6);
  EXPECT_EQ(value("5.345e3 nm", Dimension::length), 5.345e-6);
  EXPECT_EQ(value("0.7 GPa", Dimension::stress), 0.7e9);
}

TEST(ParseQuantity, TakesNumbersWithoutUnitAsSi) {
  EXPECT_EQ(value(" +1.5E+2 ", Dimension::length), 150.0);
  EXPECT_EQ(value(".5", Dimension::length), 0.5);
  EXPECT_EQ(value("-2", Dimension::none), -2.0);
}

TEST(ParseQuantity, RefusesUnitsOfAnotherDimensionAndNamesItsOwn) {
  const ParsedQuantity parsed = parse_quantity("10 mm", Dimension::stress);
  EXPECT_FALSE(parsed.value);
  EXPECT_EQ(parsed.problem, "\"mm\" is no unit of stress; allowed units: Pa, kPa, MPa, GPa");
}

TEST(ParseQuantity, RefusesWhatIsNoFiniteNumber) {
  for (const char* text : {"", "GPa", "nan", "inf", "-inf Pa", "e5", ".", "-", "1,5 m", "1 m m", "0x10"}) {
    EXPECT_FALSE(parse_quantity(text, Dimension::length).value) << text;
  }
}

TEST(ParseQuantity, RefusesWhatADoubleCannotHold) {
  for (const char* text :
       {"1e400", "-1e400", "1e305 GPa", "1e99999999999999999999", "1e-99999999999999999999"}) {
    const ParsedQuantity parsed = parse_quantity(text, Dimension::stress);
    EXPECT_FALSE(parsed.value) << text;
    EXPECT_NE(parsed.problem.find("outside the range of a double"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace anticrack
