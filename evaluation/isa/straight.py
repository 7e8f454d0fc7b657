"""The road of short drives past one post: straight, empty, in Germany."""

from services.simulator.scenario.plan import (
    BendPlan,
    EgoPlan,
    GantryPlan,
    RoadClass,
    RoadPlan,
    Scenario,
    SignPlan,
    StretchPlan,
    TrafficPlan,
    WeatherPlan,
)


def straight(
    name: str,
    ego: EgoPlan,
    *,
    signs: tuple[SignPlan, ...] = (),
    gantries: tuple[GantryPlan, ...] = (),
    road_class: RoadClass = "rural",
    rain_mm_h: float = 0.0,
) -> Scenario:
    """A kilometre of such a road; a motorway has two lanes and a median, a town houses and pavements."""
    motorway, town = road_class == "motorway", road_class == "urban"
    stretch = StretchPlan(from_m=0.0, road_class=road_class, surroundings="houses" if town else "fields", pavement=town)
    return Scenario(
        name=f"isa-{name}",
        country="DEU",
        road=RoadPlan(
            bends=(BendPlan(length_m=1000.0),),
            stretches=(stretch,),
            lanes=2 if motorway else 1,
            median_m=3.0 if motorway else 0.0,
        ),
        ego=ego,
        weather=(WeatherPlan(at_s=0.0, rain_mm_h=rain_mm_h),),
        traffic=TrafficPlan(forward=0, oncoming=0),
        signs=signs,
        gantries=gantries,
    )
