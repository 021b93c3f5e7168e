#include "tree/volume_demand.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace volume_demand_test {

using adaptive_bvh::VolumeDemand;

/// So many steps with queries by boxes until the volumes may rest.
int stepsToRest(VolumeDemand& demand) {
  for (int steps = 1;; ++steps) {
    demand.askForPositions();
    demand.nextStep();
    if (demand.volumesMayRest()) return steps;
  }
}

bool mayRest(VolumeDemand& demand) {
  demand.nextStep();
  return demand.volumesMayRest();
}

TEST(VolumeDemand, MayRestAfterAStepOfOtherQueries) {
  VolumeDemand demand;
  EXPECT_EQ(1, stepsToRest(demand));
  for (int step = 0; step < 5; ++step) EXPECT_TRUE(mayRest(demand)) << "nobody asked";
}

TEST(VolumeDemand, StepsWithoutQueriesDoNotCount) {
  VolumeDemand demand;
  for (int step = 0; step < 20; ++step) EXPECT_FALSE(mayRest(demand));
  EXPECT_EQ(1, stepsToRest(demand));
}

TEST(VolumeDemand, QueriesOfTheVolumesBeginAnew) {
  VolumeDemand demand;
  for (int step = 0; step < 20; ++step) {
    demand.askForPositions();
    demand.askForVolumes();
    EXPECT_FALSE(mayRest(demand));
  }
}

TEST(VolumeDemand, WhoWakesThemOftenLetsThemRestLater) {
  VolumeDemand demand;
  for (int patience = 1; patience < 1024; patience *= 2) {
    EXPECT_EQ(patience, stepsToRest(demand));
    demand.askForVolumes();
    EXPECT_FALSE(mayRest(demand));
  }
  EXPECT_EQ(1024, stepsToRest(demand));
}

TEST(VolumeDemand, TheBoxTreeMayRestInAStepAfterNobodyAskedForIt) {
  VolumeDemand demand;
  demand.nextStep();
  EXPECT_TRUE(demand.boxTreeMayRest());
  demand.askForBoxTree();
  demand.nextStep();
  EXPECT_FALSE(demand.boxTreeMayRest());
  demand.askForPositions();
  demand.nextStep();
  EXPECT_TRUE(demand.boxTreeMayRest());
}

}  // namespace volume_demand_test
