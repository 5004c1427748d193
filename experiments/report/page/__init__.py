"""`hebbtorch report`: one HTML file about a run or a campaign, readable without a network."""
