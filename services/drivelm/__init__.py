"""The vision-language front end: reads tracked signs, panels and lights, and says typed facts about the road."""
