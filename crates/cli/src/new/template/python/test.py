import unittest

import slate
from MODULE_KIND import Follower


class FollowerTest(unittest.TestCase):
    def wheels(self, x, y):
        """Command at the origin with heading 0."""
        follower = slate.Fixture(Follower)
        follower.set("position", x=0.0, y=0.0, z=0.0)
        follower.set("orientation", theta=0.0)
        follower.set("target", x=x, y=y)
        self.assertEqual(follower.tick(), slate.Outcome.OK)
        return follower.output("wheels")

    def test_drives_straight_to_a_target_ahead(self):
        wheels = self.wheels(2.0, 0.0)
        self.assertEqual(wheels["left"], wheels["right"])
        self.assertGreater(wheels["left"], 0.0)

    def test_turns_to_a_target_beside_it(self):
        wheels = self.wheels(0.0, 1.0)
        self.assertTrue(wheels["right"] > 0.0 > wheels["left"])

    def test_stands_still_at_the_target(self):
        self.assertEqual(self.wheels(0.0, 0.01), {"left": 0.0, "right": 0.0})

    def test_commands_nothing_without_a_fresh_position(self):
        follower = slate.Fixture(Follower)
        follower.set("target", x=1.0, y=0.0)
        self.assertEqual(follower.waiting_for(), "position")
        follower.set("position", x=0.0, y=0.0, z=0.0)
        follower.set("orientation", theta=0.0)
        follower.expire("position")
        self.assertEqual(follower.tick(), slate.Outcome.DEGRADED)
        self.assertIsNone(follower.output("wheels"))
